// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Triangles brought to the screen: clipped, culled, and sorted into bands of rows, so that threads
/// can draw bands side by side. A sample that two triangles share belongs to exactly one of them,
/// and what is drawn does not depend on the order of the bands.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/vector.h"
#include "raster/raster_loops.h"

namespace polyhull {

inline constexpr int band_rows = 16;

/// What is nearer to the eye is not drawn unless it is asked for, metres.
inline constexpr double near_depth = 0.01;

/// Where a pixel's samples lie, and that of its middle after them; \p samples 1, 2, 4 or 8. The
/// places are those of Direct3D's and most graphics processors' patterns.
const float (*sample_places(int samples))[2];

/// Where a sample of pixel (\p x, \p y) lies in \p rows, packed or not.
inline std::size_t sample_index(const SampleRows& rows, int x, int y, int sample) {
  const int width = rows.right - rows.left, height = rows.bottom - rows.top;
  const int pixel = (y - rows.top) * width + x - rows.left;
  return static_cast<std::size_t>(rows.packed ? pixel * rows.samples + sample
                                              : sample * width * height + pixel);
}

/// Which side of a triangle is drawn.
enum class Facing {
  both,
  clockwise,         ///< the corners go round clockwise on the screen: outsides, seen directly
  counterclockwise,  ///< outsides in a mirror
};

/// From a clip space (projection.h) to homogeneous pixels (x z, y z, z), pixel (i, j) from (i, j)
/// to (i + 1, j + 1).
Mat4 pixels_from_clip(int width, int height);

/// A corner: homogeneous pixels, and how far on the kept side of the clipping plane it lies.
struct Corner {
  Vec3 pixel{0.0};
  double kept = 1.0;
};

class ScreenTriangles {
 public:
  /// Forgets the triangles; the next are for a picture of this size. What is nearer than \p near (metres) is
  /// not drawn.
  void begin(int width, int height, double near = near_depth);

  /// Adds what of a triangle lies before the eye and on the kept side of the plane. Triangles with
  /// numbers that are not finite are left out.
  void add(const std::array<Corner, 3>& corners, std::uint32_t id, Facing facing);

  /// Draws band \p band (rows band * band_rows and on) into \p rows, which may be part of it. The
  /// ids there are \p first plus numbers for piece().
  void draw(int band, const SampleRows& rows, std::uint32_t first = 0) const;

  /// Draws of the pieces those that \p numbers names into packed \p rows, as draw() does.
  void draw(std::span<const std::uint32_t> numbers, const SampleRows& rows,
            std::uint32_t first = 0) const;

  /// Calls give(triangle, number) for each that draw() draws of band \p band, by the same numbers.
  template <class Give>
  void each(int band, std::uint32_t first, const Give& give) const {
    for (const std::uint32_t index : bands_[static_cast<std::size_t>(band)])
      give(triangles_[index], first + index);
  }

  /// The columns first .. end - 1 of the picture outside of which draw() changes nothing in band
  /// \p band.
  struct Columns {
    int first = 0, end = 0;
    bool empty() const { return first >= end; }
  };
  Columns columns(int band) const { return columns_[static_cast<std::size_t>(band)]; }

  /// A triangle, or a piece of one that was clipped, with the id that add() got.
  const ScreenTriangle& piece(std::uint32_t number) const { return triangles_[number]; }

  /// How many there are by now: numbers follow the order of add().
  std::uint32_t pieces() const { return static_cast<std::uint32_t>(triangles_.size()); }

 private:
  int width_ = 0, height_ = 0;
  double near_ = near_depth;
  std::vector<ScreenTriangle> triangles_;
  std::vector<std::vector<std::uint32_t>> bands_;
  std::vector<Columns> columns_;  // of the bands
};

/// Where on its triangle a point of the screen lies: the weights of the second and third corner,
/// kept inside the triangle, and the depth (z).
struct Foot {
  float second, third, depth;
};
inline Foot foot(const ScreenTriangle& triangle, double x, double y) {
  const auto at = [&](const ScreenPlane& p) { return p.value + x * p.dx + y * p.dy; };
  const double depth = 1.0 / at(triangle.inverse);
  double second = std::clamp(at(triangle.second) * depth, 0.0, 1.0);
  double third = std::clamp(at(triangle.third) * depth, 0.0, 1.0);
  const double sum = second + third;
  if (sum > 1.0) second /= sum, third /= sum;
  return {static_cast<float>(second), static_cast<float>(third), static_cast<float>(depth)};
}

}  // namespace polyhull
