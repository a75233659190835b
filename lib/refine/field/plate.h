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
/// (Hestenes and Stiefel 1952) from f0; a few dozen steps do, as f0 is near. D is symmetric, so that
/// the energy along a direction is known when D is applied once, and the second application, the step
/// and the new residual are one walk over the nodes.
#pragma once

#include <cstdint>
#include <vector>

#include "refine/field/contact_rays.h"

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
  /// Nodes of a row that may be solved for, whole eights.
  struct Row {
    std::size_t node = 0;  ///< the first
    int count = 0;
  };

  void set_up(const Level& level, const PlateSettings& settings);
  /// The pieces of a row of \p count nodes, from \p start on.
  void add_row(std::size_t start, const float* mask, int count);
  void gather(const Level& level, const ContactRays& rays, std::uint32_t part,
              const PlateSettings& settings);
  /// The residual of 0: of the ties and of the normals that rims want.
  void start(const Level& level, const ContactRays& rays, float tie);
  /// For each row in its order body(row, what loops know of it, eight sums), the rows in pieces on
  /// some threads; all sums' sum.
  template <typename Body>
  double sum_rows(int threads, const Body& body);
  /// D f and what rims ask at f; twice the energy's quadratic part.
  double bend(const float* f, float tie, int threads);
  void forget_rims();
  /// Moves by \p length of f; the new residual's square.
  double step(const float* f, float tie, float length, int threads);

  const Grid* grid_ = nullptr;
  std::vector<Row> rows_;
  std::size_t nodes_ = 0;  ///< of the rows
  // Of rims, by the slabs of their cells, whole eights: the last ones lie at node 0, outside.
  std::vector<std::int32_t> rim_node_;
  std::vector<float> rim_x_, rim_y_, rim_z_;
  std::vector<std::uint32_t> rim_ray_, sorted_;  ///< as many as there are rims
  std::vector<std::uint32_t> rims_of_slab_;
  PlateRims rims_{};
  std::vector<double> sums_;  ///< of pieces
  // Of nodes. Some are clean between calls, so that a call touches its rows only:
  std::vector<float> mask_, solution_, residual_;
  std::vector<float> laplacian_, direction_, more_;  ///< 0
};

}  // namespace polyhull::refine
