// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/blur/kept_matte.h"

#include <cstring>

#include "silhouette/pixels/kernels.h"

namespace polyhull::silhouette {

void KeptMatte::begin(int width, int height) {
  width_ = width;
  blocks_ = blocks_across(width);
  states_.resize(static_cast<std::size_t>(blocks_) * height);
  begins_.clear();
  begins_.reserve(static_cast<std::size_t>(height));
  mixed_.resize(static_cast<std::size_t>(blocks_) + 1);
  used_ = 0;
}

void KeptMatte::add_row(const std::uint8_t* alpha, const BlockState* states) {
  const auto blocks = static_cast<std::size_t>(blocks_);
  std::memcpy(states_.data() + begins_.size() * blocks, states, blocks);
  begins_.push_back(used_);
  const std::size_t most = used_ + blocks * matte_block;
  if (values_.size() < most) values_.resize(most + most / 2);
  const int mixed = kernels().mixed_blocks(states, blocks_, mixed_.data());
  for (int i = 0; i < mixed; ++i)
    std::memcpy(values_.data() + used_ + i * matte_block, alpha + mixed_[i] * matte_block,
                matte_block);
  used_ += static_cast<std::size_t>(mixed) * matte_block;
}

const Matte& KeptMatte::row(int y) {
  row_.resize(width_, 1);
  row_.stride = 0;
  const BlockState* states = states_.data() + static_cast<std::size_t>(y) * blocks_;
  const std::uint8_t* from = values_.data() + begins_[static_cast<std::size_t>(y)];
  std::uint8_t* out = row_.row(0);
  for (int b = 0; b < blocks_; ++b, out += matte_block) {
    if (states[b] == block_mixed) {
      std::memcpy(out, from, matte_block);
      from += matte_block;
    } else {
      std::memset(out, states[b] == block_full ? 255 : 0, matte_block);
    }
  }
  return row_;
}

}  // namespace polyhull::silhouette
