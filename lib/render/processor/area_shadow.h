// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What subjects take of a light from the scene: rays from every second pixel of every second
/// row to points of the light, stratified, and neighbours ask for different points.
///
///   E(x) = mean over points y of the light of  b(x, y) o(x, y) cos_x cos_y / |x - y|^2
/// b: a subject stands between (and the scene's own surfaces do not, o). The rays of 4 x 4
/// neighbouring pixels together are one stratified set, as are those of each 2 x 2 of them and of
/// each pixel (a block of Sobol's (0, 2)-sequence, which is stratified in every elementary
/// interval), and a filter that gives each of the sixteen the same weight gathers them where they
/// lie on one surface (interleaved sampling: Keller and Heidrich 2001). What subjects hide is looked up in
/// images (light_masks.h), or traced: where a first few rays all say the same, there and around, no
/// more are. Where one ray tells all, of a hard shadow and a
/// point light's, every pixel of every row has its own.
#pragma once

#include <cstdint>
#include <vector>

#include "render/processor/receiver_grid.h"
#include "render/processor/scene/scene_layer.h"
#include "render/processor/shadow_casters.h"
#include "render/shadow_recipe.h"

namespace polyhull::processor {

/// E over the picture; kept from frame to frame.
class AreaShadow : public ReceiverGrid {
 public:
  /// The pixels of which draw() asks the view's layer for \p part, whole blocks: more by what is
  /// gathered, so that what lies around does not depend on where the part ends.
  static Rectangle asked(const Rectangle& part, const LayerView& view);
  /// Those around \p part that may be gathered for it.
  static Rectangle surroundings(const Rectangle& part, const LayerView& view);

  /// Finds where in \p part of the picture \p subjects may take \p light, which is theirs, as
  /// \p view sees it; its layer's middles are drawn in the pixels asked(). Returns whether what the
  /// scene itself hides from the light is kept from before.
  bool begin(const ShadowCasters& subjects, const ShadowView& view, const Light& light,
             const ShadowRecipe& recipe, const Rectangle& part);

  /// What begin() found, and around it: a rectangle for each row of blocks.
  std::vector<Rectangle> reached(const LayerView& view) const;

  /// Computes E there; to be called once after begin(), with the same. The samples of the view's
  /// mirror are drawn where it is reached().
  void draw(ShadowCasters& subjects, const TracedScene& scene, const ShadowView& view,
            const Light& light);

  /// E at the middles of the 16 pixels from (x, y) on, which is of the last draw()'s part, and x a
  /// multiple of 16, from those of the grid around each that lie on its surface. False, and nothing
  /// written, where all are 0.
  bool taken(const SceneLayer& layer, int x, int y, float* taken) const;

 private:
  static constexpr int margin = 4;  // pixels of the picture

  struct Packet;

  bool forget(const ShadowView& view, bool other_map, bool same_places);
  bool may_shade(const LightReach& reach, const ShadowView& view, std::size_t number);
  LightReach::Extent extent_of(const LightReach& reach, const ShadowView& view,
                               std::size_t number) const;
  void find_places(const LightReach& reach, const ShadowView& view, std::size_t number);
  int find_candidates(const LightReach& reach, const TracedScene& scene, const ShadowView& view,
                      std::size_t number);
  void find_mixed(std::size_t number, int first);
  std::size_t find_open(const TracedScene& scene, int sample, Packet& packet);
  struct Scratch {
    std::vector<std::uint32_t> pixels, hidden, asking;
    std::vector<float> x, y, w;
    std::size_t count = 0;  // of the pixels
  };
  static Scratch& scratch();
  std::uint64_t find_unknown(const TracedScene& scene, const Light& light, const Vec3f* places,
                             Scratch& scratch);
  void add_given(const Light& light, const Vec3f* places, const Scratch& scratch);
  std::uint64_t look_up(const ShadowCasters& subjects, const TracedScene& scene, const Light& light,
                        int same);
  std::uint64_t trace(const ShadowCasters& subjects, const TracedScene& scene, const Light& light,
                      std::size_t number, int first, int last);
  void gather(std::size_t number);
  Rectangle around(int x, int y, int reach) const;

  std::uint64_t map_ = 0;  // ShadowCasters::map() of extents_
  // What stays as long as the view, the scene and the light do.
  SparseArray<LightReach::Place> in_light_;  // by pixel of the grid
  std::vector<LightReach::Extent> extents_;  // around a block's places
  std::vector<std::uint8_t> block_known_;    // 1: the depths are, 2: the extent, 3: the places, too
  Light light_;
  ShadowRecipe recipe_;
  std::vector<Vec3f> places_;  // on the light: as many rays as it has for each of 4 x 4 neighbours
  SparseArray<std::uint64_t> open_known_;  // by sample: whether the scene's part in b is known
  SparseArray<std::uint64_t> open_;        // and lets the ray through
  // Of this frame; a candidate_ is 2 where some of its rays differ.
  SparseArray<std::uint8_t> blocked_;  // of a pixel's rays, by subjects
  SparseArray<float> sum_, mean_, gathered_;
  std::vector<std::uint8_t> blank_;  // by block: nothing was found last time, all is 0
};

}  // namespace polyhull::processor
