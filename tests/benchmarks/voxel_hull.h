// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The hull by voxels: a grid of points, each kept when its pixel is foreground in every camera,
/// and the surface between by marching tetrahedra. What most systems do; here to be compared with.
#pragma once

#include <span>
#include <vector>

#include "hull/hull.h"

namespace polyhull::test {

class VoxelHull {
 public:
  /// \p cells along the longest side of \p bounds.
  VoxelHull(const Bounds& bounds, int cells);

  /// The surface as a mesh in Hull's form (triangles and vertices only), its origin the bounds'
  /// middle. Rows of the grid are shared out between \p threads.
  const Hull& build(std::span<const Silhouette> silhouettes, int threads = 1);

 private:
  struct Mask {
    Mat3 KR;
    Vec3 Kt;
    int width = 0, height = 0;
    std::vector<std::uint8_t> pixels;
  };
  void rasterise(const Silhouette& silhouette, Mask& mask);
  void fill_row(int y, int z);
  void march_layer(int z);

  Bounds bounds_;
  double cell_ = 0;
  int nx_ = 0, ny_ = 0, nz_ = 0;
  std::vector<Mask> masks_;
  std::vector<std::uint8_t> inside_;
  std::vector<std::int32_t> vertex_of_;  // 7 edges per node of two layers
  Hull hull_;
};

}  // namespace polyhull::test
