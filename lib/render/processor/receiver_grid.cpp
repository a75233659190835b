// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/receiver_grid.h"

#include <algorithm>
#include <bit>

namespace polyhull::processor {

Rectangle ReceiverGrid::widened(const Rectangle& part, const LayerView& view, int margin) {
  return intersection(
      {part.x - margin, part.y - margin, part.width + 2 * margin, part.height + 2 * margin},
      {0, 0, view.width, view.height});
}

Rectangle ReceiverGrid::in_whole_blocks(const Rectangle& part, const LayerView& view, int margin,
                                        int span) {
  if (part.empty()) return {};
  const Rectangle wide = widened(part, view, margin);
  const int left = wide.x / span * span, top = wide.y / span * span;
  return {left, top, std::min((wide.x + wide.width + span - 1) / span * span, view.width) - left,
          std::min((wide.y + wide.height + span - 1) / span * span, view.height) - top};
}

/// The pixels of the grid that this frame draws.
Rectangle ReceiverGrid::drawn() const {
  return intersection(
      {blocks_.x * block, blocks_.y * block, blocks_.width * block, blocks_.height * block},
      {0, 0, columns_, rows_});
}

/// The block's pixels of the grid.
Rectangle ReceiverGrid::pixels_of(std::size_t number) const {
  const int left = static_cast<int>(number) % block_columns_ * block;
  const int top = static_cast<int>(number) / block_columns_ * block;
  return {left, top, std::min(block, columns_ - left), std::min(block, rows_ - top)};
}

bool ReceiverGrid::lay_out(const ShadowView& view, int step) {
  const LayerView& size = view.layer.view();
  const int columns = (size.width + step - 1) / step, lines = (size.height + step - 1) / step;
  const auto count = static_cast<std::size_t>(columns) * lines;
  const std::pair layers{view.layer.generation(),
                         view.mirror ? view.mirror->layer.generation() : 0};
  rays_of_pixels_ = view.rays;
  bool fresh = std::exchange(layers_, layers) != layers || step != step_;
  if (fresh || columns != columns_ || lines != rows_) {
    fresh = true;
    step_ = step;
    block_shift_ = std::countr_zero(static_cast<unsigned>(step * block));
    columns_ = columns;
    rows_ = lines;
    block_columns_ = (columns + block - 1) / block;
    block_rows_ = (lines + block - 1) / block;
    inverse_.make_room(count);
    candidate_.make_room(count);
    receivers_.make_room(count);
    known_.assign(count, 0);
  }
  block_state_.assign(static_cast<std::size_t>(block_columns_) * block_rows_, 0);
  return fresh;
}

void ReceiverGrid::choose_blocks(const Rectangle& part) {
  const int span = step_ * block;  // pixels of the picture
  blocks_ = {part.x / span, part.y / span, 0, 0};
  blocks_.width = (part.x + part.width - 1) / span + 1 - blocks_.x;
  blocks_.height = (part.y + part.height - 1) / span + 1 - blocks_.y;
}

void ReceiverGrid::find_depths(const ShadowView& view, std::size_t number) {
  for_pixels(number, [&](std::size_t pixel, int x, int y) {
    inverse_[pixel] = *view.layer.middle_inverse(step_ * x, step_ * y);
  });
}

/// Whether what the block has is to be seen at all. Where none of the pixels up to those that are
/// gathered show the mirror, nobody asks what is found there.
bool ReceiverGrid::is_seen(const ShadowView& view, std::size_t number, int margin) const {
  if (!view.mirror) return true;
  const Rectangle part = pixels_of(number);
  const Rectangle pixels{step_ * part.x, step_ * part.y, step_ * part.width, step_ * part.height};
  return view.mirror->seen_in(widened(pixels, view.layer.view(), margin));
}

bool ReceiverGrid::fill(std::size_t number, std::span<const SparseArray<float>> means,
                        ShadowTile& tile) const {
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
  for (const SparseArray<float>& mean : means)
    for (int y = y0; !any && y < y1; ++y) {
      const float* row = &mean[static_cast<std::size_t>(y) * columns_];
      any = std::any_of(row + x0, row + x1, [](float value) { return value > 0.0f; });
    }
  if (!any) return false;
  if (x1 - x0 < ShadowTile::stride || y1 - y0 < ShadowTile::stride) {
    for (auto* values : {tile.inverse, tile.normal_x, tile.normal_y, tile.normal_z})
      std::fill_n(values, ShadowTile::size, 0.0f);
    std::fill_n(tile.mean[0], means.size() * ShadowTile::size, 0.0f);
    std::fill_n(tile.any_normal, ShadowTile::size, 1.0f);
  }
  for (int y = y0; y < y1; ++y) {
    const std::size_t from = static_cast<std::size_t>(y) * columns_ + x0;
    const int to = (y - top + reach) * ShadowTile::stride + x0 - left + reach;
    std::copy_n(&inverse_[from], x1 - x0, tile.inverse + to);
    for (std::size_t c = 0; c < means.size(); ++c)
      std::copy_n(&means[c][from], x1 - x0, tile.mean[c] + to);
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

void ReceiverGrid::forget_open(SparseArray<std::uint64_t>& known,
                               SparseArray<std::uint64_t>& open) const {
  for (std::size_t pixel = 0; pixel < known_.size(); ++pixel)
    if (known_[pixel]) known[pixel] = open[pixel] = 0;
}

/// A pixel between pixels of the grid takes from those to its right and below, too.
void ReceiverGrid::mark_shaded() {
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

}  // namespace polyhull::processor
