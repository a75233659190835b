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

#include "render/processor/loops/loops.h"
#include "render/processor/scene/receivers.h"
#include "render/processor/scene/scene_layer.h"
#include "render/processor/shadow_casters.h"
#include "render/shadow_recipe.h"

namespace polyhull::processor {

/// Who sees the scene on which the shadow falls.
struct ShadowView {
  const SceneLayer& layer;
  Vec3f eye{0.0f};  ///< scene coordinates
  PixelRays rays;   ///< from there, through pixels' middles; of length 1 along the view's axis
  /// Where given, only what is seen beside a pixel that shows this mirror.
  const Aperture* mirror = nullptr;
};

/// E over the picture; kept from frame to frame.
class AreaShadow {
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

  /// False where E is surely 0, for any pixel of the picture.
  bool reaches(int x, int y) const {
    const auto of_block = [this](int at) {
      return static_cast<std::size_t>(at) / block >> (step_ - 1);
    };
    return shaded_[of_block(y) * static_cast<std::size_t>(block_columns_) + of_block(x)] != 0;
  }

  /// E at the middles of the 16 pixels from (x, y) on, which is of the last draw()'s part, and x a
  /// multiple of 16, from those of the grid around each that lie on its surface. False, and nothing
  /// written, where all are 0.
  bool taken(const SceneLayer& layer, int x, int y, float* taken) const;

  /// Rays of the last draw().
  std::uint64_t rays() const { return rays_; }

 private:
  static constexpr int block = ShadowTile::side;  // pixels of the grid on a side
  static constexpr int neighbours = 16;           // pixels that ask for different places
  static constexpr int margin = 4;                // pixels of the picture

  struct Packet;

  bool lay_out(const ShadowView& view, bool other_map, bool same_places);
  bool may_shade(const LightReach& reach, const ShadowView& view, std::size_t number);
  void find_depths(const ShadowView& view, std::size_t number);
  LightReach::Extent extent_of(const LightReach& reach, const ShadowView& view,
                               std::size_t number) const;
  void find_places(const LightReach& reach, const ShadowView& view, std::size_t number);
  bool is_seen(const ShadowView& view, std::size_t number) const;
  int find_candidates(const LightReach& reach, const TracedScene& scene, const ShadowView& view,
                      std::size_t number);
  void find_mixed(std::size_t number, int first);
  std::size_t find_open(const TracedScene& scene, int sample, Packet& packet);
  std::uint64_t look_up(const ShadowCasters& subjects, const TracedScene& scene, const Light& light,
                        int same);
  std::uint64_t trace(const ShadowCasters& subjects, const TracedScene& scene, const Light& light,
                      std::size_t number, int first, int last);
  bool fill(std::size_t number, ShadowTile& tile) const;
  void gather(std::size_t number);
  void mark_shaded();
  Rectangle drawn() const;
  Rectangle pixels_of(std::size_t number) const;
  Rectangle around(int x, int y, int reach) const;
  template <class Body>
  void in_blocks(std::uint8_t least, Body&& body) const;
  /// Calls body(pixel, x, y) for the block's pixels of the grid.
  template <class Body>
  void for_pixels(std::size_t number, Body&& body) const {
    const Rectangle part = pixels_of(number);
    for (int y = part.y; y < part.y + part.height; ++y)
      for (int x = part.x; x < part.x + part.width; ++x)
        body(static_cast<std::size_t>(y) * columns_ + x, x, y);
  }

  std::uint64_t map_ = 0;  // ShadowCasters::map() of extents_
  // SceneLayer::generation() of the view's layer and mirror that what stays is of.
  std::pair<std::uint64_t, std::uint64_t> layers_{0, 0};

  // The grid: every second pixel of every second row, of a hard shadow every one; blocks of it that this frame draws.
  int step_ = 2, columns_ = 0, rows_ = 0, block_columns_ = 0, block_rows_ = 0;
  Rectangle blocks_;
  // What stays as long as the view, the scene and the light do.
  std::vector<Receiver> receivers_;          // by pixel of the grid, candidates' alone
  std::vector<float> inverse_;               // 1/z
  std::vector<std::uint8_t> known_;          // 1: the receiver is
  std::vector<LightReach::Place> in_light_;  // by pixel of the grid
  std::vector<LightReach::Extent> extents_;  // around a block's places
  std::vector<std::uint8_t> block_known_;    // 1: the depths are, 2: the extent, 3: the places, too
  Light light_;
  PixelRays rays_of_pixels_;
  ShadowRecipe recipe_;
  std::vector<Vec3f> places_;  // on the light: as many rays as it has for each of 4 x 4 neighbours
  std::vector<std::uint64_t> open_known_;  // by sample: whether the scene's part in b is known
  std::vector<std::uint64_t> open_;        // and lets the ray through
  // Of this frame.
  std::vector<std::uint8_t> candidate_;  // 1: a subject may shade it, 2: some of its rays differ
  std::vector<std::uint8_t> blocked_;    // of a pixel's rays, by subjects
  std::vector<float> sum_, mean_, gathered_;
  std::vector<std::uint8_t> blank_;  // by block: nothing was found last time, all is 0
  // 1: may be shaded, and from draw() on has candidates; 2: E is not 0 somewhere.
  std::vector<std::uint8_t> block_state_;
  std::vector<std::uint8_t> shaded_;  // by block: E is not 0 there or beside it
  std::uint64_t rays_ = 0;
};

}  // namespace polyhull::processor
