// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The look-ups that a picture's pixels cost, compiled once per instruction set (view_loops.inc) and
/// chosen at run time. The results are the same to the bit: plain C++ without contraction.
#pragma once

#include <cstdint>

#include "base/instruction_set.h"

namespace polyhull {

using Float4 = float __attribute__((vector_size(16)));  // as in float4.h, which includes too much

/// A picture of a texture's pyramid; its first column and row stand once more behind its last.
struct TextureLevel {
  int first;  ///< of its texels among all levels'
  int width, height, stride;
};

struct TextureLevels {
  /// Square roots of linear values in units of 1/1023: red in the lowest ten bits, then green and
  /// blue.
  const std::uint32_t* texels;
  const TextureLevel* levels;
  int count;
};

/// Places in a row of the screen, one pixel apart. What is linear on the screen once divided by the
/// depth has its value there for the first place and its steps to the right and down.
struct RowCourse {
  float start, dx, dy;
};

/// Places in a row of the screen that are not quite a pixel apart: i + right[i] pixels to the right of
/// the first pixel's middle, and down[i] below. These arrays and those of the places' depths may be read,
/// and the latter written, up to the next multiple of eight numbers.
struct PlaceRow {
  int count;
  const float *right, *down;
};

struct TextureRow {
  int count;
  const float* depth;
  RowCourse inverse;  ///< of 1 (that is, the inverse depth)
  RowCourse u, v;     ///< texture coordinates
};

/// A cell of light may be divided into so many along each side.
inline constexpr int border_cells = 4;
inline constexpr int border_nodes = (border_cells + 1) * (border_cells + 1);

/// Values on a grid: node (column, row) at nodes[row * stride + column]. A cell whose first node has
/// i > 0 as its fourth number is divided: its nodes are the border_nodes from borders[(i - 1) *
/// border_nodes] on, row by row.
struct LightRow {
  const float* depth;
  RowCourse x, y;  ///< in cells; fan: y is to be divided by x / columns
  const Float4* nodes;
  const Float4* borders;
  int stride, columns, rows;
  bool fan;
};

/// The rays through the places: direction[k] + i * step[k].
struct RayRow {
  int count;
  float direction[3], step[3];
  float normal[3];  ///< of a mirror
};

/// What look-ups become in the picture: value * albedo, less what a mirror reflects instead, plus
/// emitted, and all that times weight[i] and the reflectance of the mirror that shows it. Mirrors
/// reflect f0 + (1 - f0) fifth[i].
struct ColourRow {
  int count;
  Float4 albedo, emitted;
  const float* weight;
  const float* own_fifth;  ///< null: no mirror
  Float4 own_f0;
  float own_scatter;         ///< the share of what is not reflected that a mirror scatters
  const float* shown_fifth;  ///< null: seen directly
  Float4 shown_f0;
};

struct ViewLoops {
  /// depth[i] = the reciprocal of \p inverse at place i, finite.
  void (*depths)(const RowCourse& inverse, const PlaceRow& places, float* depth);
  /// values[i] *= the texture over the footprint of a pixel at place i.
  void (*texture)(const TextureLevels& texture, const TextureRow& row, const PlaceRow& places,
                  Float4* values);
  /// values[i] = the texture at place i: one look at the level whose texels are as large as the
  /// pixel's area there.
  void (*texels)(const TextureLevels& texture, const TextureRow& row, Float4* values);
  /// The texture's mean over the parallelogram uv +- du/2 +- dv/2.
  void (*over)(const TextureLevels& texture, const float* uv, const float* du, const float* dv,
               Float4* mean);
  /// values[i] = the light at place i.
  void (*light)(const LightRow& row, const PlaceRow& places, Float4* values);
  /// fifth[i] = (1 - cos)^5 of the angle between ray i and the mirror's normal, for Schlick's
  /// approximation.
  void (*fresnel)(const RayRow& row, float* fifth);
  /// Adds the colours to a picture of three floats a pixel.
  void (*add)(const ColourRow& row, const Float4* values, float* picture);
  /// same[i] = whether the eight ids of pixel i, from ids[8 i] on, are alike; one[i] = their first.
  void (*alike)(const std::uint32_t* ids, int count, std::uint8_t* same, std::uint32_t* one);
  /// Writes \p count pixels of three floats as four bytes each, by linear_to_srgb() with its \p table: red
  /// at place \p red, 0 or 2, then green and blue or blue and green, and 255.
  void (*encode)(const float* picture, int count, const std::uint8_t* table, int red,
                 std::uint8_t* pixels);

  static const ViewLoops& baseline();
  static const ViewLoops& avx2();
  static const ViewLoops& best() { return best_loops<ViewLoops>(); }
};

}  // namespace polyhull
