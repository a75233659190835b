// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Fills the video frames of rigtestsrc.
#pragma once

#include <gst/video/video.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "plugins/rigtestsrc/settings.h"
#include "studio/cameras/camera_picture.h"

namespace polyhull::element {

/// A camera and the memory that its frames are drawn in.
struct RigTestDrawing {
  std::unique_ptr<CameraPicture> picture;
  double metres_per_unit = 1.0;
  std::vector<std::uint8_t> rgba;  // where the buffer has another format
  std::vector<float> depth;
};

/// Does before the stream begins what its first frame would take long for, which a live one could
/// not make up for.
void prepare(RigTestDrawing& drawing, const RigTestSettings& settings);

/// Draws frame number \p number at the time that was set on drawing.picture, as settings.output
/// says, in the format of \p frame. Throws Error.
void draw(RigTestDrawing& drawing, const RigTestSettings& settings, std::uint64_t number,
          const GstVideoFrame& frame);

}  // namespace polyhull::element
