// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a calibrated camera sees of a triangle mesh, with antialiased outlines.
///
/// Only first hits are wanted, of one opaque closed mesh, so scan conversion does what ray casting
/// would at a fraction of the time. Each pixel has 64 sample points on a sheared 8 x 8 lattice,
/// whose projections onto either axis are 64 different positions, so upright and level outlines are
/// as well resolved as slanted ones. Vertices are projected with the lens distortion and rounded to
/// 1/1024 px; edge functions are integers, so neighbouring triangles leave no gap. Triangles with
/// an edge longer than 16 px are split at the midpoints of their edges first, which lets straight
/// edges bend under distortion.
///
/// Coverage is the share of the 64 samples inside any triangle. Which surface a pixel shows is
/// decided by depth at 16 of them; samples that lie together in depth make one fragment, shaded
/// once at their common centre.
///
/// Only where an outline passes does a pixel of a closed mesh need its samples: elsewhere one
/// surface covers it all, which its centre finds. Outlines lie on edges between a triangle that
/// faces the camera and one that does not. Where a mesh comes with its neighbours, samples are taken
/// in the pixels that such edges touch, with the same coverage and depth as everywhere.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/vector.h"
#include "rig/camera.h"

namespace polyhull {

/// One surface inside one pixel.
struct Fragment {
  std::uint32_t triangle = 0;
  Vec3f at{0.0f};       ///< barycentric coordinates in that triangle
  float depth = 0.0f;   ///< z_cam
  float weight = 0.0f;  ///< share of the covered part of the pixel; a pixel's weights add up to 1
};

/// One pixel that the mesh touches.
struct CoveredPixel {
  int x = 0;
  float coverage = 0.0f;      ///< 0..1 in steps of 1/64
  float centre_depth = 0.0f;  ///< z_cam at the pixel's centre, 0 where the mesh does not cover it
  int fragment_count = 0;
  Fragment fragments[4];
};

/// Keeps its memory from one call to the next. Not for use by two threads at once.
class CoverageRaster {
 public:
  struct Mesh {
    std::span<const Vec3f> positions;
    std::span<const std::uint32_t> triangles;
    Mat3 linear{1.0};  ///< positions to the camera's world: linear * p + origin
    Vec3 origin{0.0};
    float separation = 0.02f;  ///< world units; fragments differ in depth by at least this
    /// Empty: all pixels take samples. Else the mesh is closed, only pixels at outlines take them,
    /// and this is the triangle beyond each side (corner k to the next of triangle t: 3 t + k).
    std::span<const std::uint32_t> neighbours = {};
  };
  /// Gets row \p y and its covered pixels from left to right. Called once per row with any, from
  /// several threads of the pool in no particular order.
  using RowSink = std::function<void(int y, std::span<const CoveredPixel> pixels)>;

  /// Draws \p mesh as \p camera sees it. Returns the rectangle that holds all covered pixels.
  Rectangle draw(const Camera& camera, const Mesh& mesh, const RowSink& sink);

 private:
  struct ScreenPoint {
    std::int32_t x = 0;  // 1/1024 px
    std::int32_t y = 0;
    float inverse_depth = 0.0f;
    bool valid = false;  // in front of the camera and where the lens model holds
  };
  struct Vertex : ScreenPoint {
    Vec3 position{0.0};  // camera coordinates
    Vec2 ideal{0.0};     // pinhole pixel, where in front of the camera
    bool in_front = false;
  };
  struct Corner {
    Vertex vertex;
    Vec3f at{0.0f};
  };
  struct Triangle {
    std::int32_t x[3], y[3];
    float inverse_depth[3];
    std::uint32_t source;
    std::uint32_t corners;   // index into corner_coordinates_, or no_corners
    std::uint32_t outlines;  // bit k: there may be an outline from corner k to the next
  };
  static constexpr int band_rows = 16;
  struct Samples;
  struct Band;
  struct Setup;

  Vertex project(const Vec3& position) const;
  // Bit k of sides: there may be an outline on the side opposite to corner k.
  void split(const Corner& a, const Corner& b, const Corner& c, std::uint32_t source,
             unsigned sides, int depth);
  void emit(const ScreenPoint* const points[3], const Corner* const* corners, std::uint32_t source,
            unsigned sides);
  bool is_small(const ScreenPoint* const points[3]) const;
  void find_facing(const Mesh& mesh);
  enum class Way : std::uint8_t { none, whole, split };  // of a triangle to the screen
  void split_all(const Mesh& mesh);
  void find_valid_region(const Camera& camera);
  void mark_outlines(const Triangle& triangle, Band& band) const;
  void draw_band(int first_row, int rows, const Rectangle& region, std::span<const Triangle> list,
                 float separation, const RowSink& sink) const;
  static void cover_centres(const Triangle& triangle, const Setup& setup, std::uint32_t index,
                            int x_first, int x_last, int y_first, int y_last, Band& band);
  static void cover_samples(const Triangle& triangle, const Setup& setup, std::uint32_t index,
                            int x, int y, Samples& samples);
  void cover(const Triangle& triangle, std::uint32_t index, Band& band) const;
  void cover_all(std::span<const Triangle> list, Band& band) const;
  void cover_all_avx2(std::span<const Triangle> list, Band& band) const;
  void show(const Triangle& triangle, float depth, int x, int y, CoveredPixel& pixel) const;
  void resolve(std::span<const Triangle> list, const Band& band, int x, int y, float separation,
               CoveredPixel& pixel) const;
  Vec3f weights(const Triangle& triangle, float x, float y) const;  // of the corners, at a point
  Fragment fragment(const Triangle& triangle, const Vec3f& weights, float depth) const;
  Fragment fragment(const Triangle& triangle, float x, float y) const;

  const Camera* camera_ = nullptr;
  Mat3 linear_{1.0};  // positions to camera coordinates
  Vec3 origin_{0.0};
  bool two_sided_ = false;
  bool everywhere_ = false;
  Vec2 valid_min_{0.0}, valid_max_{0.0};  // pinhole pixels
  std::vector<double> known_lens_;        // the lens that valid_min_, valid_max_ belong to
  std::vector<ScreenPoint> vertices_;
  std::vector<std::uint8_t> facing_;  // of each triangle: bits front, back
  std::vector<Way> ways_;
  std::vector<Vec3f> corner_coordinates_;
  // The triangles that reach into each band of rows. They lie together: to fetch them from all over
  // the mesh takes longer than to draw them.
  std::vector<std::vector<Triangle>> bands_;
  struct {
    std::int32_t left, right, top, bottom;
  } drawn_{};  // by all triangles
};

}  // namespace polyhull
