// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// One face of the hull: what of a cone's face, or of the bounds', lies inside all other cones.
///
/// The face of the cone i through the rays d0, d1 from the centre C is the set of the points
///   X = h d0' + t e' + w C',   d0' = d0/|d0|, e' = (d1-d0)/|d1-d0|, C' = (C, 1)/S,
/// homogeneous, with h = 1: t runs along the contour edge and w is one over the depth (S: a
/// length). A face of the box has a corner and two axes in place of d0', e' and C'. In (t, w) every
/// plane g becomes the line A + B t + D w = 0, positive inside, with (A, B, D) = (g(d0'), g(e'),
/// g(C')), and the faces of another cone become straight segments, the cone's silhouette pulled
/// back.
///
/// The face starts as the strip between its two rays, from the far to the near plane, and is cut by
/// one cone after the other. Its border is kept as closed loops of edges, each on the line of one
/// plane with the inside on its left; a corner is the common point of the face's and two more
/// planes. For a cone j:
/// 1. the grid over the silhouette j tells which edges may meet the face's picture there; if none,
///    the face is kept or dropped as a whole;
/// 2. each such edge's line is crossed with the loops' edges; sorted along the line, the crossings
///    pair up into what lies inside the face; of that, the part between the edge's two rays is a
///    piece of new border;
/// 3. sorted along each old edge, the crossings tell where it enters and leaves the cone j: the new
///    loops follow old edges from where they enter to where they leave, and pieces from there to
///    the next entry (Weiler and Atherton 1977). Loops without a crossing are located as a whole.
/// All of it rests on one predicate, on which side of a plane a corner lies: in doubles with an
/// error bound first, else exactly by PlaneSet::orientation.
///
/// Signs. A corner of two oriented lines L, M is s (L x M) with s = +-1 such that h > 0 (L x M in
/// the order h, t, w). Going along L with its inside on the left, M grows by -(L x M).h, so s is
/// known from which way M is crossed, without arithmetic.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hull/faces/clipping_problem.h"

namespace polyhull::hull {

/// The loops of faces; corners by their three planes in rising order. A cone's apex is (cone, ring,
/// apex_mark).
using CornerKey = std::array<std::uint32_t, 3>;
inline constexpr std::uint32_t apex_mark = 0xffffffffu;
/// Equality without the call to memcmp() that == of arrays is.
inline bool same(const CornerKey& a, const CornerKey& b) {
  return ((a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2])) == 0;
}

/// Line coefficients are below 1 with absolute errors below 10 units of 1.1e-16, so a product of
/// two lines is off by less than 45 units and a determinant by less than 300: here is a factor 3
/// more.
inline constexpr double determinant_error = 1e-13;
/// A tolerance that leaves every decision to exact arithmetic.
inline constexpr double undecided = 1e300;

struct FaceLoops {
  std::vector<CornerKey> corners;
  std::vector<std::uint32_t> loop_ends;  ///< into corners
  std::vector<std::uint32_t> faces;      ///< numbers of faces that have loops
  std::vector<std::uint32_t> face_ends;  ///< into loop_ends
  std::uint64_t predicates = 0, exact = 0, broken = 0;
  void clear() {
    corners.clear(), loop_ends.clear(), faces.clear(), face_ends.clear();
    predicates = exact = broken = 0;
  }
};

class FaceClipper {
 public:
  /// Corners in (h, t, w) with the planes that make them; tolerance: the filter's error bound.
  struct Corner {
    double h, t, w, tolerance;
    std::uint32_t plane1, plane2;
    /// Of the exact determinant (face, plane1, plane2, g) against g's at the corner.
    std::int8_t sign;
    bool apex;
  };
  struct Line {
    double a, b, d;
  };

  void begin(const ClippingProblem& problem);

  /// Appends the loops of the faces [begin, end), seen counter-clockwise from outside. The result
  /// depends on the block only, not on what was clipped before.
  void clip(std::uint32_t begin, std::uint32_t end, FaceLoops& out);

 private:
  struct Edge {
    Line line;  ///< oriented
    std::uint32_t plane;
    std::int8_t orientation;  ///< of the line against the plane
  };
  /// A corner of a loop and the edge to the next one.
  struct Node {
    Corner corner;
    Edge edge;
  };
  struct Picture {  ///< how chart coordinates appear to a cone
    Vec3 a, b, d;   ///< directions from its centre
  };
  struct Cut {
    Line line;
    std::uint32_t edge;  ///< of the cone; the plane's number is base + edge
    std::uint32_t plane;
  };
  struct Extent {
    double t0, t1, w0, w1;
    double error;  ///< the largest of the corners' tolerances
    bool endless;  ///< up to the apex, or not known
  };
  /// Loops that lie apart from the face's others along the rays.
  struct Part {
    std::vector<Node> nodes;               ///< one loop after the other
    std::vector<std::uint32_t> loop_ends;  ///< into nodes
    Extent extent;
  };
  /// The face at work.
  struct Chart {
    std::uint32_t face = 0, local = 0;
    std::int32_t cone = -1;  ///< of the face; -1: a face of the box
    int handed = 1;          ///< sign of the chart against the face's plane
    double unit = 1.0;       ///< 1/S
    Vec3 axis_a{0.0}, axis_b{0.0}, axis_c{0.0}, corner{0.0};
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

  bool start(std::uint32_t face);
  void start_cone_face();
  void start_box_face();
  void add_rectangle(const std::array<Node, 4>& nodes);
  void cut_by_box();
  void cut_by_cones(std::vector<std::uint32_t>& order);
  bool cut_part();
  void divide(std::size_t part);
  void to_front(std::vector<std::uint32_t>& order);
  void look_at(std::uint32_t cone);
  enum class Meeting { inside, outside, perhaps };
  struct Quadrilateral;
  Meeting gather();
  Meeting gather_edges(Quadrilateral& quad, const ContourGrid::Block& block, double error);
  Meeting locate(const Cone& cone, const Vec2& pixel, double error) const;
  double pixel_error(double tolerance, double sum, const Vec2& pixel, double z) const;
  const Line& cached_line(std::uint32_t edge) {
    if (line_stamp_[edge] != look_now_) {
      line_stamp_[edge] = look_now_;
      lines_[edge] = line_of(cone_->normals[edge], picture_);
    }
    return lines_[edge];
  }
  void begin_cuts();
  void add_cut(const Line& line, std::uint32_t edge, std::uint32_t plane);
  bool apply_cuts();
  bool runs_forward() const;
  void cross_edges(std::uint32_t cut);
  void sort_crossings(std::uint32_t node);
  bool loop_inside(std::uint32_t begin, std::uint32_t end);
  bool follow(std::uint32_t crossing);
  bool follow_pieces(std::uint32_t& piece, std::uint32_t last);
  bool inside_cone(std::uint32_t node);
  bool inside_cone_exact(std::uint32_t node);
  std::uint32_t following(std::uint32_t node) const;
  int side(const Crossing& x, std::uint32_t plane, const Line& line, int orientation);
  void append(const Crossing& x, const Edge& edge);
  Corner corner_at_ray(std::uint32_t ray);
  /// Of two edges' lines; \p s is the s of their corner (see above).
  static Corner make_corner(const Edge& l, const Edge& m, int s);
  void emit(FaceLoops& out);

  /// Of the corner against the line of the plane; \p orientation: of that line against the plane.
  int side(const Corner& v, std::uint32_t plane, const Line& line, int orientation = 1) {
    ++predicates_;
    const double x = value(v, line);
    if (x > v.tolerance) return 1;
    if (x < -v.tolerance) return -1;
    return side_exactly(v, plane, orientation);
  }
  int side_exactly(const Corner& v, std::uint32_t plane, int orientation);
  static double value(const Corner& v, const Line& l) { return l.a * v.h + l.b * v.t + l.d * v.w; }
  static Line line_of(const Vec3& normal, const Picture& p) {
    return {glm::dot(normal, p.a), glm::dot(normal, p.b), glm::dot(normal, p.d)};
  }
  /// Whether the corner of \p node is on the inner side of the cut.
  bool inner(std::uint32_t cut, std::uint32_t node) const {
    return masks_[cut * words_ + (node >> 6)] >> (node & 63) & 1;
  }

  const ClippingProblem* problem_ = nullptr;
  Chart chart_;
  std::vector<Part> parts_;  ///< the first part_count_ are in use
  std::size_t part_count_ = 0;
  bool changed_ = false;        ///< whether the cuts have changed the part
  Part* part_ = nullptr;        ///< at work
  const Cone* cone_ = nullptr;  ///< that cuts it; null: a plane of the box does
  std::uint32_t base_ = 0;      ///< the cone's first plane
  Picture picture_{};
  Vec3 pixel_a_{0.0}, pixel_b_{0.0}, pixel_d_{0.0};  ///< picture_ in homogeneous pixels
  bool forward_ = true;  ///< whether the cone's edges run as the new border's
  std::vector<std::uint32_t> order_, new_order_;
  std::vector<std::uint8_t> bounds_face_;  ///< of each cone, whether the last face has its planes
  struct Loop {
    Extent extent;
    std::uint32_t begin, end;
  };
  std::vector<Loop> loops_;
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
  std::vector<std::uint32_t> entries_;  ///< crossings where loops enter the cone
  std::vector<std::uint32_t> crowded_;  ///< nodes whose edges have several crossings
  std::vector<std::uint32_t> candidates_;
  std::uint32_t candidate_count_ = 0;
  std::vector<std::uint32_t> stamp_, line_stamp_;
  std::vector<Line> lines_;
  std::vector<std::uint32_t> piece_at_ray_;  ///< the piece that begins there, if of this cone
  std::vector<std::array<int, 2>> rows_;
  std::uint32_t stamp_now_ = 0, look_now_ = 0;
  std::uint64_t predicates_ = 0, exact_ = 0, broken_ = 0;
};

}  // namespace polyhull::hull
