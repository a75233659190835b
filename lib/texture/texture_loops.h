// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The inner loops of visibility, compiled once per instruction set (texture_loops.inc) and chosen
/// at run time. The results are the same to the bit: plain C++ without contraction.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/instruction_set.h"

namespace polyhull {

/// A picture of 1 / depth, 0 where there is no surface; texel (x, y) is a point sample there. Rows
/// are DepthGrid::padding floats apart from width, so that eight may be read and written at any
/// texel of them.
struct DepthGrid {
  static constexpr int padding = 8;
  int width = 0, height = 0, stride = 0;
  float* inverse = nullptr;
};

/// A piece of a triangle on a view's grid, some texels large.
struct Piece {
  float x[3], y[3];        ///< corners, texels
  float inverse[3];        ///< 1 / depth there
  std::uint32_t triangle;  ///< of the mesh
  float part;              ///< its share of the triangle's area
};

/// What follows from a piece.
struct PieceShape {
  float left, right, top, bottom;  ///< what it covers, texels
  float nearest, farthest;         ///< the largest and the smallest 1 / depth
  float area;  ///< twice, texels; negative where the piece faces the view: rows go down
  /// From one texel to the next, across and down: the barycentric coordinates of its second, third
  /// and first corner and 1 / depth, which are 0, 0, 1 and inverse[0] at the first corner.
  float across[4], down[4];
};

/// The side of a cell of rims, texels.
inline constexpr int rim_cell = 8;

/// What the grid says of a piece.
enum class Judged : std::uint8_t {
  seen,    ///< nothing before it anywhere near
  hidden,  ///< something before it everywhere near
  open,    ///< an edge of what hides it may lie across it
  lost,    ///< the grid has nothing of it nor of its surroundings: it fell between samples
};

/// Points spread evenly over a piece, on the grid.
struct PieceSamples {
  static constexpr int count = 64;
  float x[count], y[count];
  float inverse[count];
};

/// Pieces that may hide others, in arrays that may be read for DepthGrid::padding beyond \p count.
struct Occluders {
  int count = 0;
  const float *left, *right, *top, *bottom, *nearest;  ///< as PieceShape has them
  const std::uint32_t* piece;                          ///< which each is
};

/// Distances in a map of what a view sees: those from a texel to the next, and more than any.
inline constexpr int texel_distance = 10, far_away = 1 << 20;

/// What turns depths and distances into an OcclusionMap's values.
struct MapScale {
  int width, height;   ///< texels, at least 2 x 1
  float margin, ramp;  ///< texels: where the fade begins to rise, and how far it rises
  float near, scale;   ///< depth of value 0, values to a unit of depth
};

/// Points of a mesh: x, y, z one after the other.
struct MeshPoints {
  std::size_t count = 0;
  const float* xyz = nullptr;
};

/// What is known of a mesh's triangles, each in an array of its own.
struct FaceArrays {
  std::size_t count = 0;
  const float *nx, *ny, *nz;  ///< unit normals, 0 where the triangle has no area
  const float *mx, *my, *mz;  ///< centroids
};

struct TextureLoops {
  /// Points through \p matrix (3 x 4): x / z, y / z, 1 / z; 0 three times where z is not positive.
  void (*project)(const double (*matrix)[4], const MeshPoints& points, float* x, float* y,
                  float* inverse);

  /// For each triangle n . (eye - m) / |eye - m|.
  void (*cosines)(const FaceArrays& faces, const float* eye, float* cosine);

  /// Draws the nearest 1 / depth of the pieces that face the view, and gives their shapes.
  void (*draw)(const Piece* pieces, std::size_t count, const DepthGrid& grid, PieceShape* shapes);

  /// Judges what is seen as a whole: pieces far from all rims before them, with nothing before their
  /// plane at the texel nearest to their middle. The numbers of the others, and of those with
  /// \p own_rim, are written to \p near. Returns how many. \p rims: per rim_cell texels either way
  /// the largest 1 / depth of the rims there and in the eight cells around. \p relative: the depth
  /// that a texel's width spans, as a share of the depth.
  std::size_t (*settle)(const Piece* pieces, const PieceShape* shapes, std::size_t count,
                        const DepthGrid& grid, const DepthGrid& rims, const std::uint8_t* own_rim,
                        float relative, Judged* judged, std::uint32_t* near);

  /// What the texels on and around a piece say.
  Judged (*judge)(const Piece& piece, const PieceShape& shape, const DepthGrid& grid,
                  float relative);

  /// The largest texel on and around what \p shape covers.
  float (*largest)(const PieceShape& shape, const DepthGrid& grid);

  /// Which of \p occluders may hide a part of \p piece, whose shape is \p own: writes their numbers
  /// to \p found, which has room for occluders.count, and returns how many.
  int (*before)(const Piece& piece, const PieceShape& own, const Occluders& occluders,
                const Piece* pieces, const PieceShape* shapes, std::uint32_t* found);

  /// Spreads samples over a piece: b of its second and third corner, evenly on the surface.
  void (*spread)(const Piece& piece, const float (*b)[PieceSamples::count], PieceSamples& samples);

  /// Which samples one of the \p count pieces numbered \p found hides: bit i of the result.
  std::uint64_t (*hidden)(const PieceSamples& samples, const std::uint32_t* found, int count,
                          const Piece* pieces, const PieceShape* shapes);

  /// A view's weights of \p points: \p sums holds for each the area of the triangles around it that
  /// face the view and of these the seen area. With \p normals (else null) times the cosine of the
  /// angle between them and the ways to \p eye.
  void (*weigh)(const MeshPoints& points, const float* normals, const float* eye, const float* sums,
                float* weights);

  /// Sets \p distance to 0 on texels without surface (\p depth 0) and beside a jump: where depth changes
  /// by more than \p most times the smaller one from one texel to the next; else to far_away.
  void (*mark_jumps)(const float* depth, int width, int height, float most, int* distance);
  /// Distances to the nearest texel that is 0, straight on and diagonally.
  void (*spread_distances)(int* distance, int width, int height);
  /// A map's fade from the distances, and its depths, each the farthest of a texel and those around it;
  /// \p wide has room for as many.
  void (*finish_texels)(const float* depth, const int* distance, const MapScale& map, float* wide,
                        std::uint16_t* depths, std::uint8_t* fade);

  static const TextureLoops& baseline();
  static const TextureLoops& avx2();
  static const TextureLoops& best() { return best_loops<TextureLoops>(); }
};

}  // namespace polyhull
