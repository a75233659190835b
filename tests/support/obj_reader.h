// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Wavefront OBJ files, read with tinyobjloader.
#pragma once

#include <string>
#include <vector>

#include "base/vector.h"

namespace polyhull {

struct ObjMaterial {
  std::string name;
  Vec3f colour{0.5f};   ///< Kd
  std::string texture;  ///< map_Kd as a path that can be opened, or empty
};

/// The triangles of a file; polygons are triangulated.
struct ObjModel {
  std::vector<Vec3f> positions;
  std::vector<std::uint32_t> triangles;  ///< three indices into positions each
  std::vector<Vec2f> coordinates;        ///< per triangle corner, v upwards, or none
  std::vector<Vec3f> normals;            ///< per triangle corner, or none
  std::vector<int> materials;            ///< per triangle: index into material_list, -1: none
  std::vector<ObjMaterial> material_list;
};

/// Throws Error: missing file, no triangles, an index out of range, numbers that are not finite.
ObjModel read_obj(const std::string& path);

}  // namespace polyhull
