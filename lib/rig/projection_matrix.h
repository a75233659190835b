// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From 3x4 projection matrices to cameras.
///
/// P = s K [R | t] with an unknown scale s != 0, K upper triangular with a positive diagonal and
/// K33 = 1, R a rotation. RQ decomposition of the left 3x3 block M (Hartley & Zisserman, Multiple
/// View Geometry, 2nd ed., A4.1.1) gives K and R up to signs; det M > 0 fixes them for s > 0. The
/// sign of s cannot be seen in one matrix: with s < 0 a right-handed camera looks like a
/// left-handed one that sees the scene in front. Cameras of one rig look at a common place, and
/// that decides.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rig/camera.h"

namespace polyhull {

/// Rows of a projection matrix: pixel ~ P (X, Y, Z, 1).
using ProjectionMatrix = std::array<std::array<double, 4>, 3>;

/// The place a set of cameras looks at: the point nearest (least squares) to their optical axes;
/// nothing for fewer than two cameras or parallel axes. Signs of the matrices do not matter.
std::optional<Vec3> common_focus(std::span<const ProjectionMatrix> matrices);

/// K, R and t of \p matrix into \p camera; the other members stay. \p focus, a point the camera
/// sees, decides the matrix' sign; without it the matrix must give positive depths in front. Throws
/// Error (naming \p where) for numbers that are not finite, a singular matrix, a pose [R | t] without K,
/// and a left-handed frame.
void set_projection(Camera& camera, const ProjectionMatrix& matrix, std::optional<Vec3> focus,
                    const std::string& where);

}  // namespace polyhull
