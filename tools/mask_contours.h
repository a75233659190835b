// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From a mask picture to the contours that hullbuild would get from contourfind.
#pragma once

#include <string>

#include "rig/camera.h"
#include "silhouette/rings.h"

namespace polyhull {

struct MaskSettings {
  double sigma = 1.0;      ///< px of blur before tracing, 0: none
  double tolerance = 1.0;  ///< px that the polygons may leave the traced contour
};

/// Reads \p path (PNG or JPEG; its alpha where it has one, else its grey level: foreground bright),
/// traces and approximates it, and takes \p camera's lens distortion out of the vertices. Throws
/// Error when the picture cannot be read or is not of the camera's size.
Rings contours_of_mask(const std::string& path, const Camera& camera, const MaskSettings& settings);

}  // namespace polyhull
