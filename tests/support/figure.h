// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A moving figure of capsules and its silhouettes, for scenes whose size and detail can be chosen.
#pragma once

#include <functional>
#include <vector>

#include "base/rings.h"
#include "rig/camera.h"

namespace polyhull::test {

/// All points within `radius` of the segment from `a` to `b`.
struct Capsule {
  Vec3 a, b;
  double radius;
};

/// A walking figure about 1.8 units tall, z up, around the origin; \p time in seconds. One arm
/// rests on the hip, so that most views have a hole.
std::vector<Capsule> walking_figure(double time);

/// A closed tube around the (2, 3) torus knot, about 2 units wide.
std::vector<Capsule> torus_knot(int pieces = 96);

/// The silhouette of \p body in \p camera: the zero line of the distance of each pixel's ray from
/// the body, on a grid of \p step pixels (fewer vertices with a larger step), oriented as the
/// conventions have it, snapped to 1/16 px; rings are simple and disjoint. Cut by the frame's
/// border where the body reaches it.
Rings silhouette_of(const std::vector<Capsule>& body, const Camera& camera, double step);

/// The zero line of \p field (negative inside) sampled at nodes (left + i step, top + j step),
/// 0 <= i < columns, 0 <= j < rows; nodes on the outermost rows and columns count as outside.
Rings zero_line(const std::function<double(double u, double v)>& field, double left, double top,
                double step, int columns, int rows);

}  // namespace polyhull::test
