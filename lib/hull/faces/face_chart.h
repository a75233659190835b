// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Coordinates on one face, and on which side of a plane its points lie.
///
/// The face of the cone i through the rays d0, d1 from the centre C is the set of the points
///   X = h d0' + t e' + w C',   d0' = d0/|d0|, e' = (d1-d0)/|d1-d0|, C' = (C, 1)/S,
/// homogeneous, with h = 1: t runs along the contour edge and w is one over the depth (S: a
/// length). A face of the box has a corner and two axes in place of d0', e' and C'. In (t, w) every
/// plane g becomes the line A + B t + D w = 0, positive inside, with (A, B, D) = (g(d0'), g(e'),
/// g(C')), and the faces of another cone become straight segments, the cone's silhouette pulled
/// back.
///
/// Signs. A corner of two oriented lines L, M is s (L x M) with s = +-1 such that h > 0 (L x M in
/// the order h, t, w). Going along L with its inside on the left, M grows by -(L x M).h, so s is
/// known from which way M is crossed, without arithmetic.
#pragma once

#include <array>
#include <cstdint>

#include "hull/faces/clipping_problem.h"

namespace polyhull::hull {

/// Line coefficients are below 1 with absolute errors below 10 units of 1.1e-16, so a product of
/// two lines is off by less than 45 units and a determinant by less than 300: here is a factor 3
/// more.
inline constexpr double determinant_error = 1e-13;
/// A tolerance that leaves every decision to exact arithmetic.
inline constexpr double undecided = 1e300;

struct Line {
  double a, b, d;
};

/// Corners in (h, t, w) with the planes that make them; tolerance: the filter's error bound.
struct Corner {
  double h, t, w, tolerance;
  std::uint32_t plane1, plane2;
  /// Of the exact determinant (face, plane1, plane2, g) against g's at the corner.
  std::int8_t sign;
  bool apex;
};

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

/// A chart's d0', e' and C' as seen from somewhere.
struct ChartAxes {
  Vec3 a, b, d;
};

/// A plane's line, from its normal and the axes from a point of the plane.
inline Line line_of(const Vec3& normal, const ChartAxes& axes) {
  return {glm::dot(normal, axes.a), glm::dot(normal, axes.b), glm::dot(normal, axes.d)};
}

/// The line's value at the corner.
inline double value(const Corner& v, const Line& l) {
  return l.a * v.h + l.b * v.t + l.d * v.w;
}

/// Of two edges' lines; \p s is the s of their corner (see above).
Corner make_corner(const Edge& l, const Edge& m, int s);

struct FaceChart {
  const ClippingProblem* problem = nullptr;
  std::uint32_t face = 0, local = 0;
  std::int32_t cone = -1;  ///< of the face; -1: a face of the box
  int handed = 1;          ///< sign of the chart against the face's plane
  double unit = 1.0;       ///< 1/S
  Vec3 axis_a{0.0}, axis_b{0.0}, axis_c{0.0}, corner{0.0};
  /// The strip between the face's two rays, from the far to the near plane, or the box's rectangle.
  std::array<Node, 4> start;
  std::uint64_t predicates = 0, exact = 0;

  /// Lays the chart on the face; false if nothing of it can be in the hull.
  bool lay(std::uint32_t number);

  /// The axes as seen from the point.
  ChartAxes seen_from(const Vec3& point) const {
    const Vec3 to = (corner - point) * unit;
    if (cone >= 0) return {axis_a, axis_b, to};
    return {to, axis_b, axis_c};
  }

  /// On which side of the plane the corner is, whose line is \p line; \p orientation: of that line
  /// against the plane.
  int side(const Corner& v, std::uint32_t plane, const Line& line, int orientation = 1) {
    ++predicates;
    const double x = value(v, line);
    if (x > v.tolerance) return 1;
    if (x < -v.tolerance) return -1;
    return side_exactly(v, plane, orientation);
  }
  int side_exactly(const Corner& v, std::uint32_t plane, int orientation);

 private:
  void lay_on_cone();
  void lay_on_box();
};

}  // namespace polyhull::hull
