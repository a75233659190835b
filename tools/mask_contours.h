// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From a mask or a keyed picture to the contours that hullbuild would get from contourfind.
#pragma once

#include <string>

#include "base/rings.h"
#include "rig/camera.h"

namespace polyhull {

struct MaskSettings {
  double sigma = 1.0;      ///< px of blur before tracing, 0: none
  double tolerance = 1.0;  ///< px that the polygons may leave the traced contour
  int keep_largest = 0;    ///< only this many pieces, the largest, are kept; 0: all
};

/// Reads \p path (PNG or JPEG; its alpha where it has one, else its grey level: foreground bright),
/// traces and approximates it, and takes \p camera's lens distortion out of them. Throws
/// Error when the picture cannot be read or is not of the camera's size.
Rings contours_of_mask(const std::string& path, const Camera& camera, const MaskSettings& settings);

/// The contours of the subject in a mask, as contours_of_mask() reads it, or in a picture of the
/// subject before a coloured screen, which is keyed (KeyColour::automatic); in pixels of the
/// picture, distortion and all. Pieces of less than a thousandth of the largest one's area are left
/// out. Throws Error when the picture cannot be read, is not of the camera's size, shows no screen,
/// or holds no subject.
Rings contours_of_picture(const std::string& path, const Camera& camera,
                          const MaskSettings& settings);

}  // namespace polyhull
