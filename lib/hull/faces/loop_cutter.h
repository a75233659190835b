// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Loops on a face cut by a cone's edges, or by one plane (Weiler and Atherton 1977).
///
/// Each edge's line is crossed with the loops' edges; sorted along the line, the crossings pair up
/// into what lies inside the face; of that, the part between the edge's two rays is a piece of new
/// border. Sorted along each old edge, the crossings tell where it enters and leaves the cone: the
/// new loops follow old edges from where they enter to where they leave, and pieces from there to
/// the next entry. Loops without a crossing are located as a whole.
#pragma once

#include <cstdint>
#include <vector>

#include "hull/exact/pair.h"
#include "hull/faces/cone_view.h"

namespace polyhull::hull {

/// Loops of edges with the inside on their left, that lie apart from the face's others along the
/// rays.
struct Part {
  std::vector<Node> nodes;               ///< one loop after the other
  std::vector<std::uint32_t> loop_ends;  ///< into nodes
  Extent extent;
};

class LoopCutter {
 public:
  LoopCutter(FaceChart& chart, ConeView& view) : chart_(chart), view_(view) {}

  /// Before the first face, where the largest cone has \p most edges.
  void begin(std::size_t most) { piece_at_ray_.assign(most, 0); }

  /// The edges that add_cut() gets next are those of the view's cone, or, without \p by_cone, a
  /// plane.
  void begin_cuts(Part& part, bool by_cone);
  /// Keeps the line as a cut if it has corners on both sides. \p edge: of the cone.
  void add_cut(const Line& line, std::uint32_t edge, std::uint32_t plane);
  bool any_cuts() const { return !cuts_.empty(); }

  /// Makes of the loops what the cuts and the cone leave of them; false if that is nothing.
  bool apply();
  /// Whether apply() has changed the part.
  bool changed() const { return changed_; }

  std::uint64_t broken = 0;  ///< decisions that contradicted each other

 private:
  struct Cut {
    Line line;
    std::uint32_t edge;  ///< of the cone; the plane's number is base + edge
    std::uint32_t plane;
  };
  /// A cut's line with an edge; the point s (edge x cut) as it comes out of the cross product.
  struct Crossing {
    double h, t, w;
    std::uint32_t node, cut;
    std::uint32_t later;  ///< the next one of the same edge
    std::uint32_t piece;  ///< that begins here
    std::int8_t place;    ///< bit 0: before the cut's first ray, bit 1: beyond its last
    std::int8_t sign;     ///< s; positive where the loop leaves the cone
    bool done;
  };
  /// What of a cut is new border.
  struct Piece {
    std::uint32_t cut;
    std::uint32_t from, to;  ///< crossings, or the cut's rays
    bool done;
  };

  bool runs_forward() const;
  void cross_edges(std::uint32_t cut);
  void find_crossings(std::uint32_t cut);
  void sort_along_cut();
  void sort_crossings(std::uint32_t node);
  bool loop_inside(std::uint32_t begin, std::uint32_t end);
  bool follow(std::uint32_t crossing);
  bool follow_pieces(std::uint32_t& piece, std::uint32_t last);
  std::uint32_t following(std::uint32_t node) const;
  /// As FaceChart::side().
  int side(const Crossing& x, std::uint32_t plane, const Line& line, int orientation) {
    ++chart_.predicates;
    const double d = line.a * x.h + line.b * x.t + line.d * x.w;
    const int sign = (d > determinant_error) - (d < -determinant_error);
    return sign != 0 ? sign : side_exactly(x, plane, orientation);
  }
  int side_exactly(const Crossing& x, std::uint32_t plane, int orientation);
  void append(const Crossing& x, const Edge& edge);
  Corner corner_at_ray(std::uint32_t ray);
  /// Whether the corner of \p node is on the inner side of the cut.
  bool inner(std::uint32_t cut, std::uint32_t node) const {
    return masks_[cut * words_ + (node >> 6)] >> (node & 63) & 1;
  }

  FaceChart& chart_;
  ConeView& view_;
  Part* part_ = nullptr;        ///< at work
  const Cone* cone_ = nullptr;  ///< that cuts it; null: a plane does
  std::uint32_t base_ = 0;      ///< the cone's first plane
  bool changed_ = false;
  bool forward_ = true;  ///< whether the cone's edges run as the new border's
  std::vector<Node> new_nodes_;
  std::vector<std::uint32_t> new_loop_ends_;
  std::vector<Cut> cuts_;
  std::size_t words_ = 0;  ///< of a mask
  /// Two corners of the part; of an odd number the last one twice.
  struct CornerPair {
    Pair h, t, w, tolerance;
  };
  std::vector<CornerPair> packed_;
  std::vector<std::uint64_t> masks_;  ///< of each cut one bit per node: inner()
  std::vector<Crossing> crossings_;
  std::vector<Piece> pieces_;
  std::vector<std::uint32_t> on_cut_, on_edge_, first_on_edge_;  ///< crossings
  std::vector<std::uint32_t> entries_;       ///< crossings where loops enter the cone
  std::vector<std::uint32_t> crowded_;       ///< nodes whose edges have several crossings
  std::vector<std::uint32_t> piece_at_ray_;  ///< the piece that begins there, if of this cone
};

}  // namespace polyhull::hull
