// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Colours of a lit scene's surfaces along rows of the screen. On a triangle everything that colour
/// needs is linear on the screen once divided by the depth, so a run of pixels costs its look-ups
/// and one division each.
#pragma once

#include <cstdint>
#include <vector>

#include "raster/raster_loops.h"
#include "raytrace/light_cache.h"

namespace polyhull {

/// Some places in a row of the screen: (x + i + right[i], y + down[i]) for i < count <= most; arrays as
/// PlaceRow's.
struct Span {
  static constexpr int most = 128;  // a multiple of eight
  double x, y;
  int count;
  const float *right, *down;
};

class SpanShader {
 public:
  /// Both must outlive this. What lights do to the scene later is seen; its meshes must stay.
  SpanShader(const TracedScene& scene, const LightCache& light);

  /// From now on seen from \p eye, for a mirror's picture the mirrored one.
  void look_from(const Vec3f& eye);

  const LightCache& light_cache() const { return light_; }

  /// The mirror of Scene::mirrors that triangle \p id belongs to; not_planar for other mirrors, and
  /// no_mirror for what is none.
  static constexpr int not_planar = -1, no_mirror = -2;
  int mirror(std::uint32_t id) const { return faces_[id].mirror; }

  /// What a mesh does to light, as seen from the eye: picture value = albedo * irradiance and
  /// texture + emitted.
  struct Look {
    Float4 albedo{}, emitted{};
    const FilteredTexture* texture = nullptr;
    bool double_sided = false;
  };

  /// The irradiance, times the texture, on \p piece (whose id counts through all meshes' triangles)
  /// at the places of \p span, into \p values. Returns what the mesh makes of it.
  const Look& shade(const ScreenTriangle& piece, const Span& span, Float4* values) const;

 private:
  /// What a triangle's colours are looked up with.
  struct Face {
    std::uint32_t mesh;
    std::uint32_t triangle;
    int mirror;
    SurfaceGrid::Face light;
    Vec2f texture[3];
  };
  void add_faces(std::uint32_t mesh);
  bool seen_from_behind(const Face& face) const;
  struct Shares;
  void light(const Face& face, const Shares& shares, const PlaceRow& places, const float* depth,
             Float4* values) const;

  const TracedScene& scene_;
  const LightCache& light_;
  std::vector<Face> faces_;  // by id
  std::vector<Look> looks_;  // by mesh
  Vec3f eye_{0.0f};
};

}  // namespace polyhull
