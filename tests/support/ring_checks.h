// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Exact checks of rings and slow references of the tracer, without a test framework, for tests and
/// fuzzers alike.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/rings.h"
#include "silhouette/pixels/matte.h"

namespace polyhull::test {

struct Segment {
  Vec2f a, b;
  std::size_t ring, index, count;
};

std::vector<Segment> segments_of(const Rings& rings);

/// Whether two edges have a point in common, other than neighbours their corner. Exact for
/// coordinates that are multiples of 1/512 below 2^15.
bool segments_meet(const Segment& s, const Segment& t);

/// What is wrong with rings that should be simple and disjoint (three corners at least, none twice
/// in a row, no two edges meet), empty when nothing is. Tests each pair of edges whose boxes
/// overlap.
std::string meeting_edges(const Rings& rings);

bool contains(std::span<const Vec2f> ring, double x, double y);

/// What is wrong with the nesting: outer rings lie inside an even number of others, holes inside an
/// odd number.
std::string nesting_fault(const Rings& rings);

double total_area(const Rings& rings);
double total_length(const Rings& rings);

/// The largest distance of points along `from` (at most `step` apart) to the rings `to`.
double one_sided_distance(const Rings& from, const Rings& to, double step);

/// Between what the area of the half level's region may be.
struct AreaBounds {
  double least, most;
  /// How far \p area lies outside, 0 inside.
  double excess(double area) const { return std::max({least - area, area - most, 0.0}); }
};

/// By marching squares in double precision, cell by cell from the field alone, half cells at the
/// frame's border included. Values are whole numbers, those from field_half on are inside: any
/// level above field_half - 1 and up to field_half is the half level of such a field. The area
/// shrinks as the level rises, so the two ends of that range bound it.
AreaBounds marching_area(const Field& field);

/// The first pixel whose centre lies on the wrong side of the rings (even-odd): it must be inside
/// exactly where the field is at or above the half level. Empty when there is none.
std::string misplaced_pixel(const Rings& rings, const Field& field);

}  // namespace polyhull::test
