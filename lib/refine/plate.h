// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The thin plate through the rims: f that bends least and has, where rays touch the body, the
/// value 0 and the cone's normal.
///
/// Over the nodes of a band, with the discrete Laplacian D, rims r with their normals n_r (out of
/// the solid), cell h and f trilinear, it minimises
///
///   sum (D f)^2 + sum over r of [ v f(r)^2 + s |h grad f(r) + h n_r|^2 ] + sum w (f - f0)^2,
///
/// f0 being f before, at most H outside the hull. The normals at the rims are second-order
/// information (Franco, Lapierre and Boyer, Visual Shapes of Silhouette Sets, 2006), here in an
/// implicit function: they make limbs round between two rims. Solved by conjugate gradients
/// (Hestenes and Stiefel 1952) from f0; a few dozen steps do, as f0 is near.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "refine/contact_rays.h"

namespace polyhull::refine {

struct PlateSettings {
  int steps = 30;          ///< of conjugate gradients
  float value = 10.0f;     ///< v
  float normal = 0.3f;     ///< s
  float tie = 0.03f;       ///< w
  float band = 2.5f;       ///< nodes with H above minus this are solved for
  std::size_t stride = 1;  ///< of the rays; their weight grows with it
};

/// Solves one part's plate after the other, and keeps the memory.
class PlateSolver {
 public:
  /// Replaces level.values. \p rays with their rims, of which those of \p part count.
  void solve(Level& level, const ContactRays& rays, std::uint32_t part,
             const PlateSettings& settings, int threads);

 private:
  /// The nodes of a row that may be solved for.
  struct Row {
    std::size_t start = 0;  ///< of its first node
    int begin = 0, end = 0;
  };
  /// What the rims in one cell ask of its eight corners: a quadratic form, of which each row is eight
  /// lanes, and a vector.
  struct Cell {
    std::uint32_t node = 0;
    std::array<float, 64> form{};
    std::array<float, 8> wanted{};
  };

  void set_up(const Level& level, const PlateSettings& settings);
  void gather(const Level& level, const ContactRays& rays, std::uint32_t part,
              const PlateSettings& settings);
  void apply(const float* f, float* out, int threads);
  void apply_cells(const float* f, float* out) const;

  const Grid* grid_ = nullptr;
  std::vector<Row> rows_;
  std::vector<float> mask_, tie_;
  std::vector<std::int32_t> cell_of_;
  std::vector<Cell> cells_;
  std::array<std::size_t, 8> corner_{};
  std::vector<float> laplacian_, solution_, residual_, direction_, image_;
};

}  // namespace polyhull::refine
