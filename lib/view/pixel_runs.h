// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A row of pixels taken apart into what each triangle shows there, pixels at edges included: what
/// is looked up for a triangle begins once for all its pixels beside each other.
#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "view/span_shader.h"

namespace polyhull {

/// Neighbouring pixels of a row that show a triangle.
struct PixelRun {
  std::uint32_t number = 0;                   ///< of the triangle
  int first = 0, count = 0;                   ///< columns
  std::uint8_t samples[Span::most];           ///< of each pixel that show it, as bits
  float weight[Span::most];                   ///< their share of the pixel
  float right[Span::most], down[Span::most];  ///< their mean's place, from the pixel's middle

  int end() const { return first + count; }
};

/// The runs of a row, gathered from the left to the right.
class PixelRuns {
 public:
  /// Adds some samples, not none, of pixel \p x, which may have no other of this triangle.
  void add(std::uint32_t number, int x, unsigned samples);

  /// Adds all samples of pixels \p x .. \p x + \p count - 1.
  void add_whole(std::uint32_t number, int x, int count);

  /// Calls visit(run) for each run that pixel \p x does not go on with, and forgets it. Call it
  /// before anything is added to a pixel, and at the row's end with one behind the next.
  template <class Visit>
  void finish_before(int x, const Visit& visit) {
    for (int i = 0; i < open_;) {
      PixelRun& run = runs_[order_[i]];
      if (run.end() >= x) {
        ++i;
        continue;
      }
      visit(run);
      std::swap(order_[i], order_[--open_]);
    }
  }

 private:
  PixelRun& run_at(std::uint32_t number, int x);

  // The triangles of the last two pixels.
  static constexpr int most = 2 * packed_samples;
  std::array<PixelRun, most> runs_{};
  std::array<std::uint8_t, most> order_ = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  int open_ = 0;  // the first so many of order_
};

}  // namespace polyhull
