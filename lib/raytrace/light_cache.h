// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The light that falls on a scene, computed once and kept on its surfaces: it does not depend on
/// the eye, so a moving camera needs only rays to see what is where.
///
/// The straight light of the lamps is kept on a fine grid (SurfaceGrid) as
///   E = sum over lights  E_unoccluded (closed form) * visible weight / whole weight
/// over `light_samples` ways to the light; where a first few of them are all free or all blocked,
/// at the node and its neighbours, no more are asked for; the lamps' light by way of planar mirrors
/// likewise. Cells in which that light has a border are divided once more, so that a sharp shadow
/// has no stairs (light_borders.cpp). What one diffuse bounce brings varies slowly and is kept on a
/// coarser grid, with the sky's light; the bounce reads the straight light where it lands. All nodes use the same ways: what error there is does not flicker from node to node.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <span>
#include <vector>

#include "raytrace/float4.h"
#include "raytrace/loops/view_loops.h"
#include "raytrace/surface_grid.h"
#include "raytrace/traced_scene.h"

namespace polyhull {

struct LightValues;

/// How finely the light is kept, and how much is asked for it.
struct LightCacheOptions {
  float spacing = 0.025f;              ///< metres between nodes of the straight light
  float bounce_spacing = 0.14f;        ///< metres between nodes of the bounced light
  int first_samples = 24;              ///< ways to each light at every node
  int light_samples = 256;             ///< ways to each light in soft shadows' edges, at most 1024
  int bounce_samples = 256;            ///< directions of bounced light, at most 1024
  std::size_t most_nodes = 3'000'000;  ///< for larger scenes the grid becomes coarser
  bool borders = true;                 ///< whether cells with borders of light are divided
  int threads = 0;                     ///< of the pool, 0: all
  /// Of this light alone, as if it shone with radiance 1 and neither the sky nor what else glows did; -1:
  /// of all that shines. Light is linear: all of it is the sum of the lights alone times their radiance,
  /// and of the rest.
  int lamp = -1;
  /// Cells are divided as in these values, of the same scene and spacing; null: where light has borders.
  std::shared_ptr<const LightValues> divided;
};

class LampShare;

/// What a filled cache is asked for, to be kept (light_store.h).
struct LightValues {
  /// Irradiance at the nodes of the fine grid, [0] for the front of the surfaces, [1] for the back
  /// of double-sided ones (empty where there are none); then the border_nodes of each divided cell,
  /// row by row. The first node of divided cell i of a side has i + 1 as its fourth number, other
  /// nodes 0.
  std::array<std::vector<Float4>, 2> sides;
  Vec3f mean_bounced{0.0f};
};

/// The same of a file (light_store.h): it takes memory only where somebody has looked.
struct MappedLight {
  std::shared_ptr<const void> file;  ///< keeps the sides in place; null: there are none
  std::array<std::span<const Float4>, 2> sides;
  Vec3f mean_bounced{0.0f};
};

class LightCache {
 public:
  /// Fills the cache. \p scene must outlive it, and have no subjects now. Once \p stop is true it
  /// comes to an end early; the light is of no use then.
  LightCache(const TracedScene& scene, const LightCacheOptions& options = {},
             const std::atomic<bool>* stop = nullptr);

  /// A cache of the same scene and options that was filled before; usable() says whether \p values
  /// fit.
  LightCache(const TracedScene& scene, const LightCacheOptions& options, LightValues values);
  /// The same of values in a file.
  LightCache(const TracedScene& scene, const LightCacheOptions& options, MappedLight values);
  bool usable() const;
  /// A copy of what the cache holds.
  LightValues all_values() const;
  /// LightValues::sides, one of them.
  std::span<const Float4> side(std::size_t number) const {
    return mapped_.file ? mapped_.sides[number] : all_.sides[number];
  }
  /// Other values, as many.
  void set_values(LightValues values) {
    all_ = std::move(values);
    mapped_ = {};
  }
  /// For when there may be no look-ups for long: gives back the memory of values in a file, which the next ones
  /// read again.
  void rest() const;

  /// This light with cells divided as in \p other, which is of a cache of the same scene and options
  /// (and this one's are not divided): looks the same.
  LightValues divided_as(const LightValues& other) const;

  /// This light of \p scene, but at the nodes that another cache of it with \p options has.
  LightValues values_for(const TracedScene& scene, const LightCacheOptions& options) const;

  /// Irradiance at a hit (of the scene, not of a subject), on the side \p back or not.
  Vec3f irradiance(const RayHit& hit, bool back) const;

  /// For many look-ups on one triangle: irradiance is gain() times what grid() finds among these
  /// values, on the front of \p mesh or on its back.
  const Float4* values(std::uint32_t mesh, bool back) const {
    return side(back && double_sided_[mesh] ? 1 : 0).data();
  }
  /// The values of divided cells.
  const Float4* borders(std::uint32_t mesh, bool back) const {
    return values(mesh, back) + fine_.size();
  }
  const SurfaceGrid& grid() const { return fine_; }
  const Vec3f& gain() const { return gain_; }

  /// All irradiance is \p gain times that of the scene as the cache was filled: what happens when
  /// all lights become brighter alike.
  void set_gain(const Vec3f& gain) { gain_ = gain; }

  /// Mean bounced irradiance, with the sky's, over the scene's surfaces.
  Vec3f mean_bounced() const { return gain_ * all_.mean_bounced; }

  std::size_t nodes() const { return fine_.size() + coarse_.size(); }
  std::uint64_t rays() const { return rays_; }
  /// More rays that this light was made with.
  void count_rays(std::uint64_t rays) { rays_ += rays; }

 private:
  using Sides = std::array<std::vector<Float4>, 2>;  // as LightValues::sides, on either grid

  bool find_double_sided(const Scene& scene);
  bool stopped() const { return stop_ != nullptr && *stop_; }
  static std::vector<LampShare> lamps_of(const TracedScene& scene, const LightCacheOptions& options,
                                         int first, int samples, int mirrored_samples);
  void fill_direct(const TracedScene& scene, const LightCacheOptions& options, bool back);
  void fill_lamp(const TracedScene& scene, const LightCacheOptions& options, const LampShare& lamp,
                 bool back, std::vector<Float4>& values, std::vector<char>* hidden);
  void ask_lamp(const TracedScene& scene, const LightCacheOptions& options, const LampShare& lamp,
                bool back, std::vector<Float4>& shares);
  void refine_borders(const TracedScene& scene, const LightCacheOptions& options, bool back);
  bool border_value(const TracedScene& scene, const std::vector<LampShare>& lamps,
                    const SurfaceGrid::Node& node, int side, Float4& value,
                    std::uint64_t& rays) const;
  void fill_bounced(const TracedScene& scene, const LightCacheOptions& options, bool back);
  void find_mean(const TracedScene& scene);

  const std::atomic<bool>* stop_ = nullptr;
  std::vector<char> double_sided_;  // by mesh
  SurfaceGrid fine_, coarse_;
  Sides direct_;                              // on the fine grid
  Sides bounced_;                             // on the coarse grid
  std::array<std::vector<char>, 2> borders_;  // by the first node of cells to be divided
  // What a frame looks up: the sides of the second where these are in a file, the rest of the first.
  LightValues all_;
  MappedLight mapped_;
  Vec3f gain_{1.0f};
  std::uint64_t rays_ = 0;
};

}  // namespace polyhull
