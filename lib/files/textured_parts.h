// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A textured mesh cut into one part per camera, for file formats. Internal.
#pragma once

#include <vector>

#include "base/picture.h"
#include "mesh/mesh.h"

namespace polyhull {

/// The triangles that take one camera's picture.
struct TexturedPart {
  int view = -1;                   ///< index into Mesh::views; -1: seen by no camera
  std::vector<Vec3f> positions;    ///< relative to Hull::origin
  std::vector<Vec3f> normals;      ///< where the hull has them, unit length
  std::vector<Vec2f> coordinates;  ///< 0..1 from the top left corner of the region of interest
  std::vector<std::uint32_t> triangles;
};

/// Parts of \p mesh, which has texturing, in the views' order, the unseen part last; empty parts
/// are left out. Linear interpolation of the coordinates strays by at most \p max_error pixels
/// along the edges, as far as splitting goes (mesh_files.h).
std::vector<TexturedPart> textured_parts(const Mesh& mesh, double max_error = 0.5);

/// The region of interest of view \p number of \p mesh, whose pixels are RGBA, as RGB, with the
/// foreground's colour spread a few pixels into the background, so that texture filters do not mix in
/// the screen's colour. Colours are multiplied as colour_of() says.
Picture texture_picture(const Mesh& mesh, std::size_t number);

}  // namespace polyhull
