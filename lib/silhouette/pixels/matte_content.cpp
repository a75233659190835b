// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/pixels/matte_content.h"

#include <algorithm>
#include <cstring>

namespace polyhull {
namespace {

bool is_uniform(const std::uint8_t* alpha, int step, int count, std::uint8_t value) {
  unsigned different = 0;
  for (int i = 0; i < count; ++i) different |= value ^ alpha[i * step];
  return different == 0;
}

bool block_matches(const std::uint8_t* values, const std::uint8_t* alpha, int step, int count) {
  unsigned different = 0;
  for (int i = 0; i < count; ++i) different |= values[i] ^ alpha[i * step];
  return different == 0;
}

bool block_matches(const std::int16_t* values, const std::uint8_t* alpha, int step, int count) {
  std::uint8_t rounded[matte_block];
  store_field_row(values, count, 0, rounded, 1);
  return block_matches(rounded, alpha, step, count);
}

template <class Plane>
bool plane_matches(const Plane& plane, const std::uint8_t* first, std::ptrdiff_t stride, int step) {
  const int blocks = blocks_across(plane.width);
  for (int y = 0; y < plane.height; ++y) {
    const auto* values = plane.row(y);
    const BlockState* states = plane.state_row(y);
    const std::uint8_t* alpha = first + stride * y;
    for (int block = 0; block < blocks; ++block) {
      const int x = block * matte_block;
      const int count = std::min(matte_block, plane.width - x);
      const std::uint8_t* at = alpha + static_cast<std::ptrdiff_t>(x) * step;
      const bool same = states[block] == block_mixed
                            ? block_matches(values + x, at, step, count)
                            : is_uniform(at, step, count, states[block] == block_full ? 255 : 0);
      if (!same) return false;
    }
  }
  return true;
}

template <class Plane>
bool same_plane(const Plane& a, const Plane& b) {
  if (&a == &b) return true;
  if (a.width != b.width || a.height != b.height) return false;
  const int blocks = blocks_across(a.width);
  for (int y = 0; y < a.height; ++y) {
    if (std::memcmp(a.state_row(y), b.state_row(y), blocks) != 0) return false;
    for (int block = 0; block < blocks; ++block) {
      if (a.state_row(y)[block] != block_mixed) continue;
      const int x = block * matte_block;
      const int count = std::min(matte_block, a.width - x);
      if (std::memcmp(a.row(y) + x, b.row(y) + x, count * sizeof(*a.row(y))) != 0) return false;
    }
  }
  return true;
}

}  // namespace

bool is_alpha_of(const MatteContent& content, const std::uint8_t* first, std::ptrdiff_t stride,
                 int step) {
  return content.matte != nullptr ? plane_matches(*content.matte, first, stride, step)
                                  : plane_matches(*content.field, first, stride, step);
}

bool same_content(const MatteContent& a, const MatteContent& b) {
  if (a.sigma != b.sigma) return false;
  if (a.matte != nullptr && b.matte != nullptr) return same_plane(*a.matte, *b.matte);
  if (a.field != nullptr && b.field != nullptr) return same_plane(*a.field, *b.field);
  return false;
}

}  // namespace polyhull
