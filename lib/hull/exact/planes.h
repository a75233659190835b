// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Exact planes and the one predicate of the hull.
///
/// World points are homogeneous, X = (x, y, z, s), s > 0. A plane is a covector p = (a, b, c, o) of
/// integers; its value at X is a x + b y + c z + o s and is positive on the side of the solid.
/// A cone face through the camera centre C and the ray directions d0, d1 (integers, see cone.h)
/// has (a, b, c) = d0 x d1 and o = -(d0 x d1).C, so it holds its centre and both rays exactly.
///
/// Degenerate positions do not exist, by simulation of simplicity (Edelsbrunner and Muecke 1990):
/// each plane stands for p + e q, where q is the plane through the camera's centre parallel to its
/// image, negative in front of the camera (or, for a face of the bounds, a shift inwards), and e is
/// a positive infinitesimal of the plane's own. So each contour edge moves inwards in its picture
/// by less than any number while cones stay cones. Of two planes the one with the lower number (the
/// earlier camera first, then the earlier edge) has the larger e, larger than any power of the
/// other's. Where faces coincide the earlier camera's wins, and no sliver remains between them.
///
/// Every decision is then the sign of det(p0 + e0 q0, p1 + e1 q1, p2 + e2 q2, p3 + e3 q3), a
/// polynomial in the e with one term for each subset of the four planes: the sign is that of the
/// first nonzero term in the order of falling size.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/vector.h"
#include "hull/exact/exact_integer.h"

namespace polyhull::hull {

struct Plane {
  Int128 a = 0, b = 0, c = 0, o = 0;
};

/// The sign of the plain determinant with these rows: -1, 0 or 1. Exact.
int determinant_sign(const Plane& p0, const Plane& p1, const Plane& p2, const Plane& p3);

/// Planes by number. A plane's perturbation is shared by its group (a camera, or a box face); group
/// -1 has none.
struct PlaneSet {
  std::vector<Plane> planes;
  std::vector<std::int32_t> group;
  std::vector<Plane> perturbation;  ///< q of each group

  /// The sign of the perturbed determinant of four different planes: -1 or 1; 0 only where no
  /// perturbation can decide (planes without one, or four of a camera's).
  int orientation(std::uint32_t p0, std::uint32_t p1, std::uint32_t p2, std::uint32_t p3) const;

  /// The common point of three different planes: the limit of the perturbed one, in the planes' own
  /// units. For planes that meet in a point of the hull it is finite.
  Vec3 point(std::uint32_t p0, std::uint32_t p1, std::uint32_t p2) const;

  /// The sign of the perturbed plane \p p at the integer point (x, y, z).
  int side_of_point(std::uint32_t p, Int128 x, Int128 y, Int128 z) const;
};

}  // namespace polyhull::hull
