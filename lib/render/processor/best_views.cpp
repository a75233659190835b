// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/best_views.h"

#include <algorithm>
#include <array>
#include <functional>

#include "render/hull_vertices.h"

namespace polyhull::processor {
namespace {

/// The weight of the first camera that is left out; 0: none is.
float left_out_of_four(const float* w, int best) {
  const float high_x = std::max(w[0], w[2]), high_y = std::max(w[1], w[3]);  // of two pairs
  const float low_x = std::min(w[0], w[2]), low_y = std::min(w[1], w[3]);
  const float second = std::max(std::min(high_x, high_y), std::max(low_x, low_y));
  const float third = std::min(std::min(high_x, high_y), std::max(low_x, low_y));
  const float fourth = std::min(low_x, low_y);
  return best == 1 ? second : best == 2 ? third : best == 3 ? fourth : 0.0f;
}

/// The same of \p count.
float left_out_of(const float* w, std::size_t count, int best) {
  const auto rank = static_cast<std::size_t>(best);
  if (rank >= count) return 0.0f;
  std::array<float, most_candidates> sorted{};
  std::copy_n(w, count, sorted.begin());
  const auto nth = sorted.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(sorted.begin(), nth, sorted.begin() + static_cast<std::ptrdiff_t>(count),
                   std::greater<>());
  return *nth;
}

}  // namespace

void keep_best_views(float* weights, std::size_t count, int best) {
  const float left_out =
      count == 4 ? left_out_of_four(weights, best) : left_out_of(weights, count, best);
  if (left_out == 0.0f) return;
  const float off = std::min(left_out, 0.999f * *std::max_element(weights, weights + count));
  for (std::size_t i = 0; i < count; ++i) weights[i] = std::max(weights[i] - off, 0.0f);
}

}  // namespace polyhull::processor
