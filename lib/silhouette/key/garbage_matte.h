// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Garbage mattes: parts of a frame that can never, or must always, be foreground.
#pragma once

#include <string_view>

#include "base/picture.h"
#include "base/rings.h"
#include "rig/camera.h"

namespace polyhull {

/// Polygons as users type them: corners "x,y" separated by white space, polygons by semicolons, in
/// full-frame pixels. Empty text gives no rings. Throws Error (bad_input) for anything that is not
/// a finite number, for polygons of fewer than three corners, and for coordinates beyond +-1e6.
Rings parse_polygons(std::string_view text);

/// Where in the frame of \p camera the box \p bounds (world coordinates) can be seen: one polygon
/// in real (distorted) pixels, its edges following the lens to a fraction of a pixel, clipped to a
/// little more than the frame. No rings when nothing is ruled out (the camera stands inside the
/// box); a polygon left of the frame when the box lies behind the camera or beside its view.
Rings bounds_outline(const Camera& camera, const Bounds& bounds);

/// A grey picture, 255 at the pixels whose centres lie inside \p rings (even-odd) and 0 elsewhere,
/// or the other way round with \p invert.
Picture polygon_mask(const Rings& rings, int width, int height, bool invert);

}  // namespace polyhull
