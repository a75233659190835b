// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What all views need of a mesh's triangles, found once.
#pragma once

#include <cstdint>
#include <vector>

#include "hull/hull.h"

namespace polyhull {

/// Of each triangle, in arrays of their own.
struct MeshFaces {
  std::vector<float> nx, ny, nz;   ///< unit normals; 0 where a triangle has no area
  std::vector<float> mx, my, mz;   ///< centroids
  std::vector<float> area;         ///< twice
  std::vector<std::int32_t> view;  ///< on whose cone it lies, -1: on none
};

/// The hull's indices must be in order and its vertices finite.
MeshFaces find_faces(const Hull& hull, int threads);

}  // namespace polyhull
