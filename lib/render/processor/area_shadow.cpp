// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/area_shadow.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <utility>

#include "base/thread_pool.h"
#include "raytrace/sampling.h"

namespace polyhull::processor {
namespace {

/// The points of the light that the rays of so many \p neighbours ask for.
std::vector<Vec3f> light_places(const Light& light, int neighbours, const ShadowRecipe& recipe) {
  const int rays = recipe.rays, first = recipe.first_rays, all = neighbours * rays;
  std::vector<Vec3f> places;
  for (int i = 0; i < all; ++i) {
    Vec2f square(0.5f);
    if (!recipe.single) {
      // The first rays of the four pixels of a 2 x 2 are four different parts of their blocks: else
      // some strata of the light would be nobody's first.
      const int turned = (i % rays + i / rays % 4 * first) % rays;
      const auto index = static_cast<std::uint32_t>(i / rays * rays + turned);
      square = Vec2f(static_cast<float>(reverse_bits(index) >> 8),
                     static_cast<float>(sobol_second(index) >> 8)) *
                   0x1p-24f +
               0.5f / static_cast<float>(all);
    }
    places.push_back(light.centre + (2.0f * square.x - 1.0f) * light.u +
                     (2.0f * square.y - 1.0f) * light.v);
  }
  return places;
}

}  // namespace

/// The pixels of the grid that this frame draws up to \p reach pixels from (x, y).
Rectangle AreaShadow::around(int x, int y, int reach) const {
  return intersection({x - reach, y - reach, 2 * reach + 1, 2 * reach + 1}, drawn());
}

/// Marks the pixels whose first rays differ, from each other or from those within two pixels.
void AreaShadow::find_mixed(std::size_t number, int first) {
  const auto state = [&](std::size_t at) {
    return blocked_[at] == 0 ? 0 : blocked_[at] == first ? 2 : 1;
  };
  for_pixels(number, [&](std::size_t pixel, int x, int y) {
    if (!candidate_[pixel]) return;
    const int own = state(pixel);
    bool other = own == 1;
    const Rectangle near = around(x, y, 2);
    for (int j = near.y; !other && j < near.y + near.height; ++j)
      for (int i = near.x; !other && i < near.x + near.width; ++i)
        other = state(static_cast<std::size_t>(j) * columns_ + i) != own;
    if (other) candidate_[pixel] = 2;
  });
}

void AreaShadow::gather(std::size_t number) {
  ShadowTile tile;
  if (!fill(number, {&mean_, 1}, tile)) return;
  const bool gathers = !recipe_.single;
  float means[block * block];
  if (gathers) Loops::best().gather(tile, 1, means);
  bool any = false;
  for_pixels(number, [&](std::size_t pixel, int x, int y) {
    if (!candidate_[pixel]) return;  // nothing reaches it
    gathered_[pixel] = gathers ? means[y % block * block + x % block] : mean_[pixel];
    any = any || gathered_[pixel] > 0.0f;
  });
  if (any) block_state_[number] = 2;
}

Rectangle AreaShadow::surroundings(const Rectangle& part, const LayerView& view) {
  return widened(part, view, margin);
}

Rectangle AreaShadow::asked(const Rectangle& part, const LayerView& view) {
  return in_whole_blocks(part, view, margin, 2 * block);
}

/// Forgets what the view or other places on the light have made void. Returns whether what the scene
/// hides from the light stays.
bool AreaShadow::forget(const ShadowView& view, bool other_map, bool same_places) {
  const bool fresh = lay_out(view, recipe_.ray_step);
  const std::size_t count = known_.size(), blocks = block_state_.size();
  if (fresh) {
    for (auto* numbers : {&sum_, &mean_, &gathered_}) numbers->make_room(count);
    blocked_.make_room(count);
    in_light_.make_room(count);
    for (auto* bits : {&open_known_, &open_}) bits->make_room(count);
    extents_.resize(blocks);
    for (auto* states : {&block_known_, &blank_}) states->assign(blocks, 0);
  } else if (other_map) {
    for (std::uint8_t& known : block_known_) known = std::min<std::uint8_t>(known, 1);
  }
  if (fresh || same_places)
    return !fresh;  // with a receiver comes that nothing is known of its light
  forget_open(open_known_, open_);
  return false;
}

bool AreaShadow::begin(const ShadowCasters& subjects, const ShadowView& view, const Light& light,
                       const ShadowRecipe& recipe, const Rectangle& shaded) {
  const bool same_places = light_ == light && recipe_ == recipe;
  light_ = light;
  recipe_ = recipe;
  const bool kept =
      forget(view, std::exchange(map_, subjects.map()) != subjects.map(), same_places);
  if (!kept) places_ = light_places(light, neighbours, recipe_);
  choose_blocks(surroundings(shaded, view.layer.view()));
  in_blocks(0, [&](std::size_t number) {
    block_state_[number] = may_shade(subjects.reach(), view, number);
  });
  return kept;
}

std::vector<Rectangle> AreaShadow::reached(const LayerView& view) const {
  const int span = step_ * block;
  std::vector<Rectangle> rows;
  for (int y = blocks_.y; y < blocks_.y + blocks_.height; ++y) {
    Rectangle row;
    for (int x = blocks_.x; x < blocks_.x + blocks_.width; ++x)
      if (block_state_[static_cast<std::size_t>(y) * block_columns_ + x])
        row = bounding(row, {x * span, y * span, span, span});
    if (!row.empty()) rows.push_back(surroundings(row, view));
  }
  return rows;
}

void AreaShadow::draw(ShadowCasters& subjects, const TracedScene& scene, const ShadowView& view,
                      const Light& light) {
  std::atomic<std::uint64_t> rays = 0;
  subjects.aim(places_);
  in_blocks(0, [&](std::size_t number) {
    block_state_[number] = find_candidates(subjects.reach(), scene, view, number) > 0;
  });
  if (subjects.masked()) {
    parallel_each(neighbours, 1, 0, [&](std::size_t same) {
      rays += look_up(subjects, scene, light, static_cast<int>(same));
    });
  } else {
    in_blocks(1, [&](std::size_t number) {
      rays += trace(subjects, scene, light, number, 0, recipe_.first_rays);
    });
    if (recipe_.rays > recipe_.first_rays) {
      in_blocks(1, [&](std::size_t number) { find_mixed(number, recipe_.first_rays); });
      in_blocks(1, [&](std::size_t number) {
        rays += trace(subjects, scene, light, number, recipe_.first_rays, recipe_.rays);
      });
    }
  }
  in_blocks(1, [&](std::size_t number) { gather(number); });
  mark_shaded();
  rays_ = rays;
}

bool AreaShadow::taken(const SceneLayer& layer, int x, int y, float* taken) const {
  const Rectangle grid = drawn();
  const int last_x = grid.x + grid.width - 1, last_y = grid.y + grid.height - 1;
  if (step_ == 1) {
    const float* row = &gathered_[static_cast<std::size_t>(y) * columns_];
    for (int i = 0; i < 16; ++i) taken[i] = x + i <= last_x ? row[x + i] : 0.0f;
    return std::any_of(taken, taken + 16, [](float value) { return value != 0.0f; });
  }
  ShadowRows rows;
  float edge[4][9];  // where the grid ends
  for (int row = 0; row < 2; ++row) {
    const auto line = static_cast<std::size_t>(std::min((y + row) / 2, last_y)) * columns_;
    rows.inverse[row] = &inverse_[line + x / 2];
    rows.taken[row] = &gathered_[line + x / 2];
    if (x / 2 + 8 <= last_x) continue;
    for (int k = 0; k < 9; ++k) {
      const std::size_t at = line + std::min(x / 2 + k, last_x);
      edge[row][k] = inverse_[at];
      edge[2 + row][k] = gathered_[at];
    }
    rows.inverse[row] = edge[row];
    rows.taken[row] = edge[2 + row];
  }
  std::uint32_t any = 0;
  for (int k = 0; k < 9; ++k)
    any |= std::bit_cast<std::uint32_t>(rows.taken[0][k]) |
           std::bit_cast<std::uint32_t>(rows.taken[1][k]);
  if (any == 0) return false;
  const float* inverse = layer.middle_inverse(x, y);
  float rest[16] = {};
  if (const int left = layer.view().width - x; left < 16) {
    std::copy_n(inverse, left, rest);
    inverse = rest;
  }
  Loops::best().take(rows, inverse, taken);
  return true;
}

}  // namespace polyhull::processor
