// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The refiner's inner loops, compiled once per instruction set (loops.inc) and chosen at run
/// time. The results are the same to the bit: plain C++ without contraction, sums in eight lanes of
/// their own, vectorised by the compiler.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/instruction_set.h"

namespace polyhull::refine {

/// A camera's map of distances (silhouette_map.h) and where it shows a point.
struct MapView {
  float pixel[3][4];  ///< homogeneous pixel of a point; the third is its depth
  float by_focal;     ///< 1 / pixels
  float beyond;       ///< pixels: the distance where the map does not reach
  float left, top, by_texel;
  float last_x, last_y;  ///< the map's last texel
  int most_x, most_y;    ///< the last texel with a next one
  int stride;
  const float* distance;
};

/// Points of a line along x: point i is (begin[0] + x[i] * cell, begin[1], begin[2]).
struct RowPoints {
  float begin[3];
  float cell;
  const float* x;
  int count;
};

/// Which nodes of a row may be inside the surface or next to it: from begin to end, none if equal.
struct Extent {
  int begin = 0, end = 0;

  /// Grows to hold \p other, which is not empty.
  void include(const Extent& other) {
    if (begin == end) *this = other;
    if (other.begin < begin) begin = other.begin;
    if (other.end > end) end = other.end;
  }
};

/// A rim, and what it asks of nodes around it (fine_field.h).
struct AskingRim {
  float at[3];        ///< in nodes
  float normal[3];    ///< of the cone's plane
  float gap;          ///< by how much f is to rise
  float reach;        ///< the radius within which it asks, in nodes
  float least_along;  ///< cosine
};

/// A slab of a grid, rows of whole eights, whose nodes are asked, those at the grid's border but for.
struct AskedSlab {
  const float* f;      ///< of its first node, with slabs before and after it
  const Extent* rows;  ///< only these nodes
  int nx, ny;
  float z;
  // What is asked of them:
  Extent* asked;  ///< holds those that are
  float* asks;    ///< of each eight of a row: eight weighted gaps, then eight weights
};

/// A function on a grid, and points of a line: point i at begin + i * way, in nodes.
struct GridLine {
  const float* values;
  int nx, ny, nz;
  float outside;  ///< the function beyond the grid
  float begin[3], way[3];
};

/// Rims of a plate (plate.h), whole eights: the first node of each one's cell, where in the cell it is
/// (0 to 1), and how firmly f and its gradient are held there. A cell's nodes are \p row and \p slab
/// apart.
struct PlateRims {
  const std::int32_t* node;
  const float *x, *y, *z;
  std::size_t count;
  std::int32_t row, slab;
  float value, normal;
};

/// Some nodes of a row, whole eights, in the middle of a grid: functions from there on, and a mask of
/// 1 where the plate is solved for, else 0.
struct PlateRow {
  int count;
  std::ptrdiff_t row, slab;
  const float* mask;
};

struct Loops {
  /// least[i] becomes at most how deep point i lies in the view's cone: the map's distance times
  /// its depth over the focal length; -1000 behind the camera.
  void (*inside)(const MapView& view, const RowPoints& points, float* least);
  /// Adds to each asked node's weight and weighted gap.
  void (*ask)(const AskingRim& rim, const AskedSlab& slab);
  /// The function at \p count points of a line, linear between nodes.
  void (*along)(const GridLine& line, int count, float* out);
  /// out = mask * Laplacian of f; to eight sums comes out^2 + tie * f^2.
  void (*laplacian)(const PlateRow& row, const float* f, float tie, float* out, float* sums);
  /// out += what the rims ask at f: the gradient of half of value f(r)^2 + normal |grad f(r)|^2; to
  /// eight sums comes twice that energy.
  void (*rims)(const PlateRims& rims, const float* f, float* out, float* sums);
  /// A step of conjugate gradients: solution += length * f, residual -= length * mask * (Laplacian
  /// of \p laplacian + tie * f + more), more = 0; to eight sums comes residual^2.
  void (*step)(const PlateRow& row, const float* f, const float* laplacian, float tie, float length,
               float* more, float* solution, float* residual, float* sums);
  /// f = residual + keep * f.
  void (*turn)(int count, const float* residual, float keep, float* f);
  /// Bit i % 64 of word i / 64 becomes 1 where f[i] > above; \p count whole eights, the words 0 before.
  void (*signs)(const float* f, float above, int count, std::uint64_t* words);

  static const Loops& baseline();
  static const Loops& avx2();
  static const Loops& best() { return best_loops<Loops>(); }
};

}  // namespace polyhull::refine
