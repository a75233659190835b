// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The contact sheet: one picture that shows what each stage made of one instant.
#pragma once

#include <vector>

#include "base/picture.h"
#include "mesh/mesh.h"

namespace polyhull::report {

struct SheetSettings {
  int columns = 4;                  ///< cameras shown, spread evenly over those of the mesh
  int tile_width = 480;             ///< pixels
  std::vector<Picture> composites;  ///< RGB or RGBA, shown large in the last rows
};

/// Rows: camera pictures, mattes, contours, hull as wire frame, hull textured (each from beside its
/// camera, where no camera stands), composites. RGB.
Picture draw_sheet(const Mesh& mesh, const SheetSettings& settings);

}  // namespace polyhull::report
