// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How much of a lamp's light reaches a place, straight or by way of a planar mirror; and of the environment's.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "raytrace/float4.h"
#include "raytrace/surface_grid.h"
#include "raytrace/traced_scene.h"

namespace polyhull {

class LampShare {
 public:
  /// Of \p light or, where \p mirrored is given, of that image of it. The others must outlive this.
  /// \p first ways to the lamp are asked for at once, up to \p samples where it is partly hidden.
  LampShare(const TracedScene& scene, const Light& light, const MirroredLight* mirrored, int first,
            int samples);

  /// Of the environment of \p scene, which there is.
  LampShare(const TracedScene& scene, int first, int samples);

  /// The irradiance of a node that sees the whole lamp, the mirror taken as perfect and a spot without its
  /// cone; none where the node faces away.
  std::optional<Vec3f> unoccluded(const SurfaceGrid::Node& node) const;

  /// By how much the light that comes is less, from 0 to 1 by colour (the fourth is 0), 1 where the
  /// lamp's front is turned away. A spot's cone is like a shade: its border is one of shadow. All ways are asked for where some of the first are blocked and
  /// others not, or with \p thorough. Adds to \p rays.
  Float4 at(const SurfaceGrid::Node& node, bool thorough, std::uint64_t& rays) const;

  /// In the place of the light's own.
  void set_radiance(const Vec3f& radiance) { radiance_ = radiance; }
  bool is_environment() const { return !ways_.empty(); }
  bool is_mirrored() const { return mirrored_ != nullptr; }

 private:
  struct Sum {
    Float4 visible{};
    Float4 whole{};
    bool blocked = false, free = false;  // some ways
  };
  void add(const SurfaceGrid::Node& node, std::span<const Vec2f> points, Sum& sum) const;
  void add_environment(const SurfaceGrid::Node& node, std::size_t first, std::size_t count,
                       Sum& sum) const;
  float light_per_radiance(const SurfaceGrid::Node& node) const;
  void add_mirrored(const SurfaceGrid::Node& node, std::span<const Vec2f> points, Sum& sum) const;

  const TracedScene& scene_;
  Light light_;
  const MirroredLight* mirrored_ = nullptr;
  Vec3f radiance_;
  std::vector<Vec2f> points_;
  /// A way to the environment: where to, and what it brings a surface that faces it.
  struct Way {
    Vec3f direction;
    Float4 light;
  };
  std::vector<Way> ways_;  // none of a lamp
  std::size_t first_;
};

/// The start of rays from a node.
inline Vec3f ray_start(const TracedScene& scene, const SurfaceGrid::Node& node) {
  return node.place + scene.epsilon() * node.normal;
}

/// Whether a node lies inside a closed body: most of what it sees are backs.
bool inside_a_body(const TracedScene& scene, const SurfaceGrid::Node& node);

/// Well spread points of the unit square, 1 to 1024.
std::vector<Vec2f> spread_points(int count, std::uint32_t seed);

}  // namespace polyhull
