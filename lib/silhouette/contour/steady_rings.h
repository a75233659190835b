// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Traced rings without the noise between pictures. Internal.
///
/// A traced line and the one of the picture before are walked along at once, as two people do with
/// a leash of length d between them: corner by corner of one, and as many of the other as that
/// needs. Where the leash suffices the old line takes the new one's place, with the corners of the
/// polygon that was made of it; elsewhere the new one stands. So what comes out lies within d of
/// what was traced (Fréchet distance), and what drifts is taken over as soon as it is d away. The
/// walk takes the next edge only where a corner asks for it, so at turns sharper than d it may let
/// go too early, which only means the new line. A ring less than half of which stays is new as a
/// whole.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/rings.h"
#include "base/vector.h"
#include "silhouette/contour/approximate.h"

namespace polyhull::silhouette {

/// Rings of one picture that the next's may keep.
class SteadyRings {
 public:
  /// Takes over what was approximated and the corners of its polygons (Approximator::nodes()).
  void assign(const Rings& rings, std::span<const RingNode> nodes);

  /// \p traced with what runs within \p distance (px) of the rings taken over replaced by them. \p
  /// kept: the corners that came along, as Approximator::approximate() takes them; a ring that has
  /// any begins with one. Rings keep their number and order.
  void splice(const Rings& traced, float distance, Rings& out, std::vector<RingNode>& kept);

 private:
  /// Edge `edge` of ring `ring`: from corner `edge`, modulo the ring's size, to the next.
  struct Place {
    std::uint32_t ring = 0, edge = 0;
  };
  /// Corners `first` to `last` of a traced ring, beside our edges from `begin` to `end`.
  struct Stretch {
    std::size_t first, last;
    Place begin;
    std::uint32_t end;
  };
  /// A ring being made.
  struct Made {
    std::size_t begin;          // of its points in out
    std::size_t node_begin;     // of its nodes in kept
    std::uint32_t least_point;  // of ours, of the node
    std::size_t least_node;     // that it shall begin with
  };

  bool find(Vec2f from, Vec2f to, Place& place) const;
  bool step(Vec2f from, Vec2f to, Place& place) const;
  Stretch walk(std::span<const Vec2f> ring, std::size_t start, std::size_t first, std::size_t most,
               Place place) const;
  bool is_whole(std::span<const Vec2f> ring, const Stretch& stretch) const;
  std::uint32_t nodes_in(const Stretch& stretch) const;
  void splice_ring(std::span<const Vec2f> ring, Rings& out, std::vector<RingNode>& kept);
  void take(std::uint32_t ring, std::uint32_t begin, std::uint32_t end, Made& made, Rings& out,
            std::vector<RingNode>& kept) const;

  Rings rings_;
  std::vector<RingNode> nodes_;
  std::vector<std::uint32_t> first_node_;  // of each point: how many nodes lie before it
  float limit_ = 0.0f;                     // the distance squared
  // Points by rows: those of row y begin at row_begins_[y - lowest_].
  int lowest_ = 0;
  std::vector<std::uint32_t> row_begins_, by_row_, ring_of_;
};

}  // namespace polyhull::silhouette
