// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How well a hull, seen by its own cameras, fills the masks it was made from.
#pragma once

#include <string>
#include <vector>

#include "mesh/mesh.h"

namespace polyhull::report {

/// Pixels of one camera's mask, and of the hull seen by that camera.
struct Coverage {
  std::string camera;
  std::size_t mask = 0;     ///< pixels of the mask
  std::size_t covered = 0;  ///< of those, where the hull is
  std::size_t outside = 0;  ///< pixels of the hull outside the mask
  double covered_share() const { return mask ? double(covered) / double(mask) : 1.0; }
  double outside_share() const { return mask ? double(outside) / double(mask) : 0.0; }
};

enum class Mask {
  contours,  ///< pixel centres inside the contours the hull was made from
  matte,     ///< pixels whose keyed alpha is at least 128
};

/// The mask of a view, one byte per pixel of the full frame, 255 inside. Mask::matte needs RGBA
/// pixels and falls back to the contours.
std::vector<std::uint8_t> mask_of(const View& view, Mask kind);

/// One row per view of \p mesh.
std::vector<Coverage> measure_coverage(const Mesh& mesh, Mask kind);

}  // namespace polyhull::report
