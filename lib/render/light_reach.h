// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Where subjects can stand between a place and an area light: an exact "no" for most of a picture,
/// so that no ray is traced there.
///
/// Seen from the light's middle c, with the light's normal as axis, a point at depth z has tangents
/// m. From the point c + d of the light's plane, the way to a receiver at (m_r, z_r) crosses depth
/// z at
///   m = m_r + d (1/z - 1/z_r)
/// of the middle's map. So what blocks any part of the light lies, in the map, within the light's
/// extent times (1/z_nearest - 1/z_r) of the receiver.
#pragma once

#include <span>
#include <vector>

#include "base/vector.h"
#include "scene/scene.h"

namespace polyhull {

class LightReach {
 public:
  /// The map of the triangles (three points each, scene coordinates). Returns whether extents found
  /// before are of another map: of another light, or a point light's that now looks elsewhere.
  bool build(const Light& light, std::span<const Vec3f> points,
             std::span<const std::uint32_t> triangles);

  /// Where a place lies in the light's map, as long as the light is the same. Places less than a
  /// millimetre before the light's plane count as behind it: 1/z is 0.
  struct Place {
    Vec2f tangents;
    float inverse;  ///< 1/z
  };
  Place place(const Vec3f& point) const;

  /// Where several lie, those before the light.
  struct Extent {
    Vec2f low{1e30f}, high{-1e30f};
    float least = 1e30f, most = 0.0f;  ///< 1/z
    bool empty() const { return low.x > high.x; }
    void add(const Place& place);
  };

  /// False where nothing that was built lies between the places and any part of the light.
  bool may_shade(const Extent& places) const;
  bool may_shade(const Place& place) const;
  /// True only where may_shade() is for each of the places before the light.
  bool must_shade(const Extent& places) const;

  /// The map, for those who ask it elsewhere (shaders/reach.frag, shadow_tiles.frag).
  static constexpr int texels = 128;  ///< of the map on a side
  struct Map {
    Vec3f centre{0.0f}, right{0.0f}, down{0.0f}, forward{0.0f};
    Vec2f extent{0.0f};            ///< of the light along right and down, half
    Vec2f low{0.0f}, scale{0.0f};  ///< texel = (tangent - low) * scale
    float nearest = 0.0f;          ///< largest 1/z of the subjects
    bool everywhere = false;       ///< the subjects reach through the light's plane
    bool point = false;            ///< the light has no plane of its own
  };
  const Map& map() const { return map_; }
  /// How many texels above and left of each of (texels + 1)^2 corners are filled, row by row; empty
  /// where Map::everywhere.
  std::span<const int> sums() const { return sums_; }

 private:
  Map map_;
  bool any_between(const Vec2f& low, const Vec2f& high, float inverse) const;
  std::vector<int> sums_;
};

}  // namespace polyhull
