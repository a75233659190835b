// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a view sees of the scene at every so many pixels of every so many rows: where shadows are asked
/// for. In blocks, of which a frame draws those that it needs.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/memory/sparse_array.h"
#include "base/thread_pool.h"
#include "render/processor/loops/loops.h"
#include "render/processor/scene/receivers.h"
#include "render/processor/scene/scene_layer.h"
#include "render/projection.h"

namespace polyhull::processor {

/// Who sees the scene on which the shadow falls.
struct ShadowView {
  const SceneLayer& layer;
  Vec3f eye{0.0f};  ///< scene coordinates
  PixelRays rays;   ///< from there, through pixels' middles; of length 1 along the view's axis
  /// Where given, only what is seen beside a pixel that shows this mirror.
  const Aperture* mirror = nullptr;
};

class ReceiverGrid {
 public:
  /// False where nothing is taken, for any pixel of the picture.
  bool reaches(int x, int y) const {
    return shaded_[static_cast<std::size_t>(y >> block_shift_) * block_columns_ +
                   (x >> block_shift_)] != 0;
  }

  /// Rays of the last drawing.
  std::uint64_t rays() const { return rays_; }

 protected:
  static constexpr int block = ShadowTile::side;  // pixels of the grid on a side
  static constexpr int neighbours = 16;           // pixels that ask for different places

  /// Which of the neighbours a pixel of the grid is: those of each 2 x 2 are consecutive.
  static int neighbour(int x, int y) {
    return (x & 1) | (y & 1) << 1 | (x & 2) << 1 | (y & 2) << 2;
  }

  /// \p part and \p margin pixels around it.
  static Rectangle widened(const Rectangle& part, const LayerView& view, int margin);
  /// The same in whole blocks of \p span pixels: what is gathered does not depend on where the part ends.
  static Rectangle in_whole_blocks(const Rectangle& part, const LayerView& view, int margin,
                                   int span);

  /// Makes room for the view's grid of every \p step pixels, a power of two. Returns whether all that is known of it is
  /// void.
  bool lay_out(const ShadowView& view, int step);
  /// This frame draws the blocks that \p part of the picture touches.
  void choose_blocks(const Rectangle& part);
  void find_depths(const ShadowView& view, std::size_t number);
  bool is_seen(const ShadowView& view, std::size_t number, int margin) const;
  /// Calls body(pixel) for the drawn pixels that are neighbour \p same, of blocks of state 1 or more.
  template <class Body>
  void for_same(int same, Body&& body) const {
    const int right = (same & 1) | (same >> 1 & 2), down = (same >> 1 & 1) | (same >> 2 & 2);
    for (int j = blocks_.y; j < blocks_.y + blocks_.height; ++j) {
      for (int i = blocks_.x; i < blocks_.x + blocks_.width; ++i) {
        const std::size_t number = static_cast<std::size_t>(j) * block_columns_ + i;
        if (block_state_[number] == 0) continue;
        const Rectangle part = pixels_of(number);
        for (int y = part.y + down; y < part.y + part.height; y += 4) {
          const std::size_t row = static_cast<std::size_t>(y) * columns_;
          const std::size_t end = row + part.x + part.width;
          for (std::size_t pixel = row + part.x + right; pixel < end; pixel += 4) body(pixel);
        }
      }
    }
  }
  /// Copies the block and its surroundings, with \p means of up to ShadowTile::channels. Returns whether any of
  /// these is above 0.
  bool fill(std::size_t number, std::span<const SparseArray<float>> means, ShadowTile& tile) const;
  /// Makes both 0 for the pixels whose receiver is known; others' are nothing yet.
  void forget_open(SparseArray<std::uint64_t>& known, SparseArray<std::uint64_t>& open) const;
  void mark_shaded();
  Rectangle drawn() const;
  Rectangle pixels_of(std::size_t number) const;
  /// Calls body(number) for the blocks of this frame whose state is at least \p least.
  template <class Body>
  void in_blocks(std::uint8_t least, Body&& body) const {
    parallel_each(
        static_cast<std::size_t>(blocks_.width) * blocks_.height, 2, 0, [&](std::size_t i) {
          const std::size_t number =
              (blocks_.y + i / blocks_.width) * block_columns_ + blocks_.x + i % blocks_.width;
          if (block_state_[number] >= least) body(number);
        });
  }
  /// Calls body(pixel, x, y) for the block's pixels of the grid.
  template <class Body>
  void for_pixels(std::size_t number, Body&& body) const {
    const Rectangle part = pixels_of(number);
    for (int y = part.y; y < part.y + part.height; ++y)
      for (int x = part.x; x < part.x + part.width; ++x)
        body(static_cast<std::size_t>(y) * columns_ + x, x, y);
  }

  // The grid, and the blocks of it that this frame draws.
  int step_ = 0, columns_ = 0, rows_ = 0, block_columns_ = 0, block_rows_ = 0;
  int block_shift_ = 0;  // a block is 1 << block_shift_ pixels of the picture on a side
  Rectangle blocks_;
  PixelRays rays_of_pixels_;
  // What stays as long as the view and the scene do.
  SparseArray<Receiver> receivers_;  // by pixel of the grid, candidates' alone
  SparseArray<float> inverse_;       // 1/z, of blocks that were drawn
  std::vector<std::uint8_t> known_;  // 1: the receiver is
  // Of this frame.
  SparseArray<std::uint8_t> candidate_;  // by pixel: not 0 where a subject may shade it
  // 1: may be shaded, and once candidates are known has some; 2: what is taken is not 0 somewhere.
  std::vector<std::uint8_t> block_state_;
  std::vector<std::uint8_t> shaded_;  // by block: it is not 0 there or beside it
  std::uint64_t rays_ = 0;

 private:
  // SceneLayer::generation() of the view's layer and mirror that what stays is of.
  std::pair<std::uint64_t, std::uint64_t> layers_{0, 0};
};

}  // namespace polyhull::processor
