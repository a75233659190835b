// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The pixels that closing a matte made foreground: parts of the subject that look like what is
/// behind, or gaps through which that is seen. Internal.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "silhouette/pixels/matte.h"

namespace polyhull::silhouette {

class ClosedGaps {
 public:
  /// No gaps.
  void clear() { kinds_.clear(); }
  /// The matte before it is closed, and after; \p reach: px by which it was grown and shaved.
  void open(const Matte& matte);
  void close(const Matte& matte, double reach);

  /// Whether row \p y has gaps; whether column \p x of it is in one.
  bool in_row(int y) const {
    return !kinds_.empty() && has_gaps_[static_cast<std::size_t>(y)] != 0;
  }
  bool at(int x, int y) const { return kind(x, y) == closed; }

  /// A pixel of the subject that is not closed; its distance from the gap's pixel, 0: none.
  struct Neighbour {
    int x = 0, y = 0, distance = 0;
  };
  /// The nearest ones of a gap's pixel to the left, right, above and below that are solid.
  std::array<Neighbour, 4> around(int x, int y) const;

 private:
  static constexpr std::uint8_t other = 0, closed = 1, solid = 2;
  std::uint8_t kind(int x, int y) const {
    return kinds_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                  static_cast<std::size_t>(x)];
  }

  int width_ = 0, height_ = 0, reach_ = 0;
  std::vector<std::uint8_t> kinds_;     // rows of width_; between open() and close() alphas
  std::vector<std::uint8_t> has_gaps_;  // of each row
};

}  // namespace polyhull::silhouette
