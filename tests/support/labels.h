// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The instants that rigtestsrc's labels name in a mesh's views.
#pragma once

#include <algorithm>
#include <vector>

#include "builtin/stamp.h"
#include "mesh/mesh.h"

namespace polyhull::test {

/// The labels in the pictures of one set, by camera; -1: not to be read.
inline std::vector<int> labels_of(const Mesh& mesh) {
  std::vector<int> labels;
  for (const MeshView& view : mesh.views) {
    const View& v = view.view;
    const auto label = v.pixels.empty()
                           ? std::nullopt
                           : read_stamp(v.pixels.data(), v.stride, v.roi.width, v.roi.height);
    labels.push_back(label ? *label : -1);
  }
  return labels;
}

/// Whether labels of one set name several instants.
inline bool are_mixed(const std::vector<int>& labels) {
  int seen = -1;
  for (const int label : labels) {
    if (label >= 0 && seen >= 0 && label != seen) return true;
    seen = std::max(seen, label);
  }
  return false;
}

}  // namespace polyhull::test
