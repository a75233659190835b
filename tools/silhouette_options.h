// SPDX-License-Identifier: LGPL-2.1-or-later
// The silhouette stage's settings as command-line options, and pictures as camera formats.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <string>
#include <vector>

#include "base/picture.h"
#include "silhouette/silhouette.h"

namespace polyhull {

/// A frame that owns its planes.
struct FrameMemory {
  FrameFormat format = FrameFormat::rgbx;
  int width = 0, height = 0;
  std::array<std::vector<std::uint8_t>, 3> planes;
  std::array<std::ptrdiff_t, 3> strides{};
  FrameView view() const;
};

/// An RGB picture as it would come from a camera (BT.601, video range).
FrameMemory pack(const Picture& picture, const std::string& format);

class SilhouetteOptions {
 public:
  void add_to(CLI::App& app);
  /// What was given; reads the mask pictures. Throws Error.
  SilhouetteSettings settings() const;

 private:
  SilhouetteSettings settings_;
  std::string key_ = "green";
  std::vector<int> roi_, screen_, foreground_;
  std::string inside_mask_, outside_mask_;
  bool uncorrected_ = false;
};

}  // namespace polyhull
