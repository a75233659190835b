// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The silhouette stage's settings as command-line options, and pictures as camera formats.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/picture.h"
#include "silhouette/silhouette.h"

namespace polyhull {

class CommandLine;

/// A frame that owns its planes.
struct FrameMemory {
  FrameFormat format = FrameFormat::rgbx;
  int width = 0, height = 0;
  std::array<std::vector<std::uint8_t>, 3> planes;
  std::array<std::ptrdiff_t, 3> strides{};
  FrameView view() const;
};

/// An RGB picture as it would come from a camera (BT.601, video range); \p format as GStreamer
/// names it: RGBx, BGRx, RGB, I420, NV12, YUY2 or UYVY.
FrameMemory pack(const Picture& picture, const std::string& format);

/// The options and what they set.
class SilhouetteOptions {
 public:
  /// Adds them to \p command, which sets this when it parses.
  void add_to(CommandLine& command);
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
