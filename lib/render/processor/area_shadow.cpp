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

/// The pixels of the grid that this frame draws.
Rectangle AreaShadow::drawn() const {
  return intersection(
      {blocks_.x * block, blocks_.y * block, blocks_.width * block, blocks_.height * block},
      {0, 0, columns_, rows_});
}

/// Those of them up to \p reach pixels from (x, y).
Rectangle AreaShadow::around(int x, int y, int reach) const {
  return intersection({x - reach, y - reach, 2 * reach + 1, 2 * reach + 1}, drawn());
}

/// The block's pixels of the grid.
Rectangle AreaShadow::pixels_of(std::size_t number) const {
  const int left = static_cast<int>(number) % block_columns_ * block;
  const int top = static_cast<int>(number) / block_columns_ * block;
  return {left, top, std::min(block, columns_ - left), std::min(block, rows_ - top)};
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

/// Copies the block and its surroundings. Returns whether any light is taken there.
bool AreaShadow::fill(std::size_t number, ShadowTile& tile) const {
  const int left = static_cast<int>(number) % block_columns_ * block;
  const int top = static_cast<int>(number) / block_columns_ * block;
  constexpr int reach = ShadowTile::reach;
  const Rectangle grid = drawn();
  const PixelRays& rays = rays_of_pixels_;
  const Vec3f ray = rays.at(step_ * left, step_ * top);
  for (int k = 0; k < 3; ++k) {
    tile.ray[k] = ray[k];
    tile.ray_x[k] = static_cast<float>(step_) * rays.x[k];
    tile.ray_y[k] = static_cast<float>(step_) * rays.y[k];
  }
  // What of it is drawn.
  const int x0 = std::max(left - reach, grid.x), y0 = std::max(top - reach, grid.y);
  const int x1 = std::min(left - reach + ShadowTile::stride, grid.x + grid.width);
  const int y1 = std::min(top - reach + ShadowTile::stride, grid.y + grid.height);
  bool any = false;
  for (int y = y0; !any && y < y1; ++y) {
    const float* row = &mean_[static_cast<std::size_t>(y) * columns_];
    any = std::any_of(row + x0, row + x1, [](float mean) { return mean > 0.0f; });
  }
  if (!any) return false;
  if (x1 - x0 < ShadowTile::stride || y1 - y0 < ShadowTile::stride) {
    for (auto* values : {tile.inverse, tile.mean, tile.normal_x, tile.normal_y, tile.normal_z})
      std::fill_n(values, ShadowTile::size, 0.0f);
    std::fill_n(tile.any_normal, ShadowTile::size, 1.0f);
  }
  for (int y = y0; y < y1; ++y) {
    const std::size_t from = static_cast<std::size_t>(y) * columns_ + x0;
    const int to = (y - top + reach) * ShadowTile::stride + x0 - left + reach;
    std::copy_n(&inverse_[from], x1 - x0, tile.inverse + to);
    std::copy_n(&mean_[from], x1 - x0, tile.mean + to);
    for (int x = 0; x < x1 - x0; ++x) {
      const bool asked = candidate_[from + x];
      const Vec3f normal = asked ? receivers_[from + x].normal : Vec3f(0.0f);
      tile.normal_x[to + x] = normal.x;
      tile.normal_y[to + x] = normal.y;
      tile.normal_z[to + x] = normal.z;
      tile.any_normal[to + x] = asked ? 0.0f : 1.0f;
    }
  }
  return true;
}

void AreaShadow::gather(std::size_t number) {
  ShadowTile tile;
  if (!fill(number, tile)) return;
  const bool gathers = !recipe_.single;
  float means[block * block];
  if (gathers) Loops::best().gather(tile, means);
  bool any = false;
  for_pixels(number, [&](std::size_t pixel, int x, int y) {
    if (!candidate_[pixel]) return;  // nothing reaches it
    gathered_[pixel] = gathers ? means[y % block * block + x % block] : mean_[pixel];
    any = any || gathered_[pixel] > 0.0f;
  });
  if (any) block_state_[number] = 2;
}

Rectangle AreaShadow::surroundings(const Rectangle& part, const LayerView& view) {
  return intersection(
      {part.x - margin, part.y - margin, part.width + 2 * margin, part.height + 2 * margin},
      {0, 0, view.width, view.height});
}

Rectangle AreaShadow::asked(const Rectangle& part, const LayerView& view) {
  if (part.empty()) return {};
  constexpr int span = 2 * block;  // pixels of the picture
  const Rectangle wide = surroundings(part, view);
  const int left = wide.x / span * span, top = wide.y / span * span;
  return {left, top, std::min((wide.x + wide.width + span - 1) / span * span, view.width) - left,
          std::min((wide.y + wide.height + span - 1) / span * span, view.height) - top};
}

/// Makes room for the view's grid, and forgets what the view or other places on the light have made
/// void. Returns whether what the scene hides from the light stays.
bool AreaShadow::lay_out(const ShadowView& view, bool other_map, bool same_places) {
  const LayerView& size = view.layer.view();
  const int step = recipe_.ray_step;
  const int columns = (size.width + step - 1) / step, lines = (size.height + step - 1) / step;
  const auto count = static_cast<std::size_t>(columns) * lines;
  const std::pair layers{view.layer.generation(),
                         view.mirror ? view.mirror->layer.generation() : 0};
  bool fresh = std::exchange(layers_, layers) != layers || step != step_;
  if (fresh || columns != columns_ || lines != rows_) {
    fresh = true;
    step_ = step;
    columns_ = columns;
    rows_ = lines;
    block_columns_ = (columns + block - 1) / block;
    block_rows_ = (lines + block - 1) / block;
    for (auto* numbers : {&inverse_, &sum_, &mean_, &gathered_}) numbers->resize(count);
    for (auto* bytes : {&candidate_, &blocked_}) bytes->resize(count);
    receivers_.resize(count);
    in_light_.resize(count);
    for (auto* bits : {&open_known_, &open_}) bits->resize(count);
    known_.assign(count, 0);
  }
  const auto blocks = static_cast<std::size_t>(block_columns_) * block_rows_;
  if (fresh) {
    extents_.resize(blocks);
    for (auto* states : {&block_known_, &blank_}) states->assign(blocks, 0);
  } else if (other_map) {
    for (std::uint8_t& known : block_known_) known = std::min<std::uint8_t>(known, 1);
  }
  block_state_.assign(blocks, 0);
  if (fresh || same_places)
    return !fresh;  // with a receiver comes that nothing is known of its light
  for (auto* bits : {&open_known_, &open_}) std::fill(bits->begin(), bits->end(), 0);
  return false;
}

/// Calls body(number) for the blocks of this frame whose state is at least \p least.
template <class Body>
void AreaShadow::in_blocks(std::uint8_t least, Body&& body) const {
  parallel_for(static_cast<std::size_t>(blocks_.width) * blocks_.height, 2, 0,
               [&](std::size_t begin, std::size_t end) {
                 for (std::size_t i = begin; i < end; ++i) {
                   const std::size_t number = (blocks_.y + i / blocks_.width) * block_columns_ +
                                              blocks_.x + i % blocks_.width;
                   if (block_state_[number] >= least) body(number);
                 }
               });
}

/// A pixel between pixels of the grid takes from those to its right and below, too.
void AreaShadow::mark_shaded() {
  shaded_.assign(block_state_.size(), 0);
  for (int y = blocks_.y; y < blocks_.y + blocks_.height; ++y) {
    for (int x = blocks_.x; x < blocks_.x + blocks_.width; ++x) {
      bool any = false;
      for (int j = y; j <= std::min(y + 1, blocks_.y + blocks_.height - 1); ++j)
        for (int i = x; i <= std::min(x + 1, blocks_.x + blocks_.width - 1); ++i)
          any = any || block_state_[static_cast<std::size_t>(j) * block_columns_ + i] == 2;
      shaded_[static_cast<std::size_t>(y) * block_columns_ + x] = any;
    }
  }
}

bool AreaShadow::begin(const ShadowCasters& subjects, const ShadowView& view, const Light& light,
                       const ShadowRecipe& recipe, const Rectangle& shaded) {
  const bool same_places = light_ == light && recipe_ == recipe;
  light_ = light;
  recipe_ = recipe;
  const Rectangle part = surroundings(shaded, view.layer.view());
  rays_of_pixels_ = view.rays;
  const bool kept =
      lay_out(view, std::exchange(map_, subjects.map()) != subjects.map(), same_places);
  if (!kept) places_ = light_places(light, neighbours, recipe_);
  const int span = step_ * block;  // pixels of the picture
  blocks_ = {part.x / span, part.y / span, 0, 0};
  blocks_.width = (part.x + part.width - 1) / span + 1 - blocks_.x;
  blocks_.height = (part.y + part.height - 1) / span + 1 - blocks_.y;
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
    parallel_for(neighbours, 1, 0, [&](std::size_t begin, std::size_t end) {
      for (std::size_t same = begin; same < end; ++same)
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
