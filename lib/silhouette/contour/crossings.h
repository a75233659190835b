// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Finds edges of rings that meet where they should not. Internal.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "base/vector.h"

namespace polyhull::silhouette {

/// An edge in units of 1/512 px, of run `run` of ring `ring`.
struct CheckedEdge {
  std::int32_t ax, ay, bx, by;
  std::uint32_t ring, run;
  bool follows(const CheckedEdge& other) const {
    return ring == other.ring && ax == other.bx && ay == other.by;
  }
};

/// Edges sorted into horizontal bands.
class EdgeBands {
 public:
  void build(const std::vector<CheckedEdge>& edges);

  /// Pairs of edges with a common point, other than neighbours in their shared corner. Each pair
  /// may be reported more than once.
  void find_crossings(const std::function<void(const CheckedEdge&, const CheckedEdge&)>& found);

  /// How many edges of other rings than \p ring a ray from the point to the right crosses.
  int crossings_right_of(std::int32_t x, std::int32_t y, std::uint32_t ring) const;

 private:
  const std::vector<CheckedEdge>* edges_ = nullptr;
  std::int32_t lowest_ = 0;
  std::int32_t height_ = 1;
  std::vector<std::uint32_t> begin_, entries_;
};

}  // namespace polyhull::silhouette
