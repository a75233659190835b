// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The rasteriser's inner loop, compiled once per instruction set (raster_loops.inc) and chosen at
/// run time. The results are the same to the bit: plain C++ without contraction, vectorised by the
/// compiler.
#pragma once

#include <cstdint>

#include "base/instruction_set.h"

namespace polyhull {

inline constexpr std::uint32_t no_triangle = 0xffffffffu;

/// A linear function of the screen: value + dx x + dy y.
struct ScreenPlane {
  double value = 0.0, dx = 0.0, dy = 0.0;
};

/// A triangle on the screen, pixel (i, j) from (i, j) to (i + 1, j + 1). What lies on its face is
/// linear on the screen once divided by the depth z: 1/z itself, and b/z of the weights of its
/// second and third corner.
struct ScreenTriangle {
  double x[3], y[3];          ///< corners from the top of the screen to the bottom
  double slope[3];            ///< dx/dy of the edges 0-2, 0-1, 1-2
  bool middle_left;           ///< corner 1 lies left of the edge 0-2
  ScreenPlane inverse;        ///< 1/z
  ScreenPlane second, third;  ///< b/z
  std::uint32_t id;
};

inline constexpr int packed_samples = 8;

/// Some rows of the picture with several samples a pixel: the largest 1/z so far and whose it is.
/// Sample s of pixel (x, y) is at index (s * (bottom - top) + y - top) * (right - left) + x - left;
/// packed, at ((y - top) * (right - left) + x - left) * samples + s, where left and right are multiples
/// of packed_samples / samples: so many pixels are drawn side by side.
struct SampleRows {
  int left, right, top, bottom;  ///< columns left .. right - 1, rows top .. bottom - 1
  int samples;
  const float (*places)[2];  ///< of the samples in a pixel, 0..1
  float* inverse;
  std::uint32_t* id;
  bool packed = false;  ///< a pixel's samples lie side by side: faster where triangles are small
};

struct RasterLoops {
  /// Draws \p triangle into \p rows, which are not packed, where it is nearest.
  void (*draw)(const ScreenTriangle& triangle, const SampleRows& rows);
  /// The same into packed rows, the \p count of \p triangles that \p numbers names, each as \p first and
  /// its number.
  void (*draw_packed)(const ScreenTriangle* triangles, const std::uint32_t* numbers, int count,
                      std::uint32_t first, const SampleRows& rows);

  static const RasterLoops& baseline();
  static const RasterLoops& avx2();
  static const RasterLoops& best() { return best_loops<RasterLoops>(); }
};

}  // namespace polyhull
