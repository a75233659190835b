// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A light cut into cells, and what its cells' centres see: the cameras of OpenGL's shadow maps.
/// And what lights give, for both renderers.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "base/vector.h"
#include "scene/scene.h"

namespace polyhull {

inline constexpr int max_light_samples = 16;

/// A shadow map's camera at \p position: depth d of the map and distance z along the axis follow
/// 1/z = inverse_from_depth.x * d + inverse_from_depth.y.
struct LightView {
  Vec3 position{0.0};
  Mat4 clip_from_scene{1.0};
  Mat4 map_from_scene{1.0};  ///< to map coordinates and depth, 0..1, after division; w is z
  Vec2 inverse_from_depth{0.0};
  /// Half a cell of the light along u (x, y) and v (z, w), in map coordinates times depth: seen from
  /// there, what lies at inverse depth a moves over what lies at b by (a - b) times that, less the
  /// half cell's depth times the map's distance from what is straight ahead (see `ahead`).
  Vec4 kernel{0.0};
  /// Map coordinates of straight ahead (x, y), and how far ahead half a cell reaches along u (z), v (w).
  Vec4 ahead{0.0};
};

/// The centres of n x n equal cells of an area light (n * n = \p samples, at least 1); a point
/// light's position alone.
std::vector<Vec3> light_cells(const Light& light, int samples);

/// A view from \p position on \p light, which has \p cells_per_side cells a side, that holds all of
/// \p points (scene coordinates) tightly, of depths (metres) up to \p far or a little more,
/// and from \p near on where that is nearer than the points.
LightView view_of_points(const Light& light, const Vec3& position, int cells_per_side,
                         std::span<const Vec3f> points, double far,
                         double near = std::numeric_limits<double>::infinity());

/// A wide view along the light's normal (a point light's: towards \p target), 150 degrees.
LightView wide_view(const Light& light, const Vec3& position, const Vec3& target, double far);

/// What the middle of \p light gives a surface at \p point that faces it, all channels together.
double light_given(const Light& light, const Vec3& point);

/// The unit normal of an area light, 0 for a point light.
Vec3f light_normal(const Light& light);

/// Radiance times area, or a point light's intensity.
Vec3f light_power(const Light& light);
/// Its channels together.
float light_strength(const Light& light);
/// \p part over \p whole, channel by channel; 0 where there is nothing of the whole.
Vec3f share_of(const Vec3f& part, const Vec3f& whole);

/// The share of light_power() that \p light sends, per solid angle, in a direction \p cosine of whose
/// angle to light_normal() is given: Lambert's of an area light, a spot's cone, 1 for a point.
float light_exit(const Light& light, float cosine);

}  // namespace polyhull
