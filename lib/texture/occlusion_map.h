// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Draws a hull into one view's OcclusionMap: nearest depth, and a fade that is 0 within a margin
/// of silhouette edges and depth discontinuities and rises to 1 over a settable width.
#pragma once

#include "hull/hull.h"
#include "rig/camera.h"
#include "texture/texturing.h"

namespace polyhull {

/// The map's longer side has at most \p size texels (at least 8); \p fade_width in pixels of the
/// camera. Triangles that reach behind the camera are left out.
OcclusionMap draw_occlusion_map(const Hull& hull, const Camera& camera, int size,
                                double fade_width);

}  // namespace polyhull
