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

/// The subject's contours in \p path: a mask, or a picture of the subject before a coloured screen
/// (load_mask_picture() tells them apart), which is keyed (KeyColour::automatic). They are traced,
/// approximated, and \p camera's lens distortion is taken out of them. How an unusual mask was
/// understood is said on standard error. Throws Error when the picture cannot be read, is not of
/// the camera's size, shows no screen, or is a mask that looks inverted.
Rings contours_of_mask(const std::string& path, const Camera& camera, const MaskSettings& settings);

/// The same in pixels of the picture, distortion and all, without the pieces of less than a
/// thousandth of the largest one's area. Throws Error, also when the picture holds no subject.
Rings contours_of_picture(const std::string& path, const Camera& camera,
                          const MaskSettings& settings);

}  // namespace polyhull
