// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <cmath>

#include "silhouette/key/key_state.h"

namespace polyhull::silhouette {
namespace {

// One step of grey dilation (or erosion) from `from` to `to`, by the four or the eight neighbours.
// Values beyond the frame are its border values.
template <bool larger>
void step(const Matte& from, Matte& to, bool eight) {
  const auto pick = [](std::uint8_t a, std::uint8_t b) {
    return larger ? std::max(a, b) : std::min(a, b);
  };
  const int w = from.width, h = from.height;
  for (int y = 0; y < h; ++y) {
    const std::uint8_t* up = from.row(std::max(y - 1, 0));
    const std::uint8_t* mid = from.row(y);
    const std::uint8_t* down = from.row(std::min(y + 1, h - 1));
    std::uint8_t* out = to.row(y);
    const auto at = [&](int x) {
      const int l = std::max(x - 1, 0), r = std::min(x + 1, w - 1);
      std::uint8_t v = pick(pick(up[x], down[x]), pick(mid[x], pick(mid[l], mid[r])));
      if (eight) v = pick(v, pick(pick(up[l], up[r]), pick(down[l], down[r])));
      return v;
    };
    out[0] = at(0);
    if (eight) {
      for (int x = 1; x < w - 1; ++x) {
        const std::uint8_t left = pick(pick(up[x - 1], down[x - 1]), mid[x - 1]);
        const std::uint8_t here = pick(pick(up[x], down[x]), mid[x]);
        const std::uint8_t right = pick(pick(up[x + 1], down[x + 1]), mid[x + 1]);
        out[x] = pick(here, pick(left, right));
      }
    } else {
      for (int x = 1; x < w - 1; ++x)
        out[x] = pick(pick(up[x], down[x]), pick(mid[x], pick(mid[x - 1], mid[x + 1])));
    }
    if (w > 1) out[w - 1] = at(w - 1);
  }
}

// Moves values towards those grown by a fraction of 256.
void blend(std::uint8_t* __restrict values, const std::uint8_t* __restrict grown, std::size_t count,
           int weight) {
  const auto to = static_cast<std::uint16_t>(weight);
  const auto from = static_cast<std::uint16_t>(256 - weight);
  for (std::size_t i = 0; i < count; ++i)
    values[i] = static_cast<std::uint8_t>(
        static_cast<std::uint16_t>(values[i] * from + grown[i] * to + 128) >> 8);
}

template <bool larger>
void steps(Matte& matte, double radius, Matte& scratch) {
  scratch.resize(matte.width, matte.height);
  // Octagons: diamonds grow the diagonal by 1/sqrt(2) per step, squares by sqrt(2). Two squares in
  // five steps give the most even octagon.
  const int whole = static_cast<int>(radius);
  const double rest = radius - whole;
  for (int i = 0; i < whole; ++i) {
    step<larger>(matte, scratch, i % 5 == 1 || i % 5 == 3);
    std::swap(matte.values, scratch.values);
  }
  if (rest <= 0.0) return;
  step<larger>(matte, scratch, whole % 5 == 1 || whole % 5 == 3);
  const int weight = static_cast<int>(std::lround(rest * 256.0));
  blend(matte.values.data(), scratch.values.data(), matte.values.size(), weight);
}

}  // namespace

void grow(Matte& matte, double radius, Matte& scratch) {
  if (radius > 0.0)
    steps<true>(matte, radius, scratch);
  else
    steps<false>(matte, -radius, scratch);
}

void limit_row(std::uint8_t* __restrict row, int width, int x0, int x1,
               const std::uint8_t* __restrict allowed) {
  std::fill(row, row + x0, 0);
  std::fill(row + x1, row + width, 0);
  if (allowed == nullptr) return;
  for (int x = x0; x < x1; ++x) row[x] &= allowed[x];
}

void fill_polygon(const Rings& rings, int width, int height, std::vector<std::uint8_t>& plane) {
  const std::size_t length = static_cast<std::size_t>(blocks_across(width)) * matte_block;
  plane.assign(length * static_cast<std::size_t>(height), 0);
  std::vector<double> crossings;
  for (int y = 0; y < height; ++y) {
    crossings.clear();
    for (std::size_t r = 0; r < rings.size(); ++r) {
      const auto ring = rings.ring(r);
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const Vec2f a = ring[i], b = ring[i + 1 < ring.size() ? i + 1 : 0];
        if ((a.y <= y) == (b.y <= y)) continue;
        crossings.push_back(a.x + (y - static_cast<double>(a.y)) /
                                      (static_cast<double>(b.y) - a.y) *
                                      (static_cast<double>(b.x) - a.x));
      }
    }
    std::sort(crossings.begin(), crossings.end());
    for (std::size_t i = 0; i + 1 < crossings.size(); i += 2) {
      const int x0 = static_cast<int>(std::clamp(std::ceil(crossings[i]), 0.0, double(width)));
      const int x1 = static_cast<int>(std::clamp(std::ceil(crossings[i + 1]), 0.0, double(width)));
      if (x1 > x0)
        std::fill_n(
            plane.begin() + static_cast<std::ptrdiff_t>(length * static_cast<std::size_t>(y)) + x0,
            x1 - x0, 255);
    }
  }
}

}  // namespace polyhull::silhouette
