// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Meshes as files for other programs: GLB (glTF 2.0), PLY, OBJ.
///
/// Coordinates stay the rig's: the same world, unit and axes, never re-centred or turned. GLB keeps
/// the hull's double-precision origin as its node's translation; PLY and OBJ hold world coordinates
/// in double precision. All say the rig's up direction and metres per unit (GLB in asset.extras,
/// PLY in comment lines, OBJ in comment lines where they are not y up and metres). As glTF
/// prescribes metres and y up, the hull's node of another rig has a parent that scales and turns it
/// to them.
///
/// Textures: each triangle takes the picture of its best camera (Texturing::best, else the visible
/// view of the largest weight); texture coordinates are the projected vertices, lens distortion
/// included. As a picture is not linear over a large triangle, triangles are split until linear
/// texture coordinates stray by at most half a pixel, up to seven times or until there are four
/// million; both sides of an edge are split alike. Triangles that no camera sees have the colour
/// Texturing::untextured. A mesh without texturing is written plain.
#pragma once

#include <string>

#include "mesh/mesh.h"

namespace polyhull {

struct MeshFileOptions {
  bool textured = true;          ///< GLB, OBJ: with the camera pictures, if the mesh has texturing
  bool double_precision = true;  ///< PLY: coordinates as double, else float
  int jpeg_quality = 90;         ///< GLB: 1..100, or 0 for PNG (OBJ always has PNG)
};

/// Writes \p mesh in the format that \p path's ending names (.glb, .ply, .obj, any case). A
/// textured OBJ file brings a .mtl file and PNG pictures beside it, whose names begin with its own, but
/// for blanks, # and the like (docs/formats.md). An empty mesh gives a valid
/// empty file. Throws Error for an unknown ending and for files that cannot be written.
void write_mesh_file(const Mesh& mesh, const std::string& path,
                     const MeshFileOptions& options = {});

/// Whether write_mesh_file() knows the ending of \p path.
bool is_mesh_file_name(const std::string& path);

/// The endings that write_mesh_file() knows, for messages: ".glb, .ply or .obj".
std::string mesh_file_endings();

}  // namespace polyhull
