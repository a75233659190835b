// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A subject from an OBJ file (tinyobjloader underneath).
#pragma once

#include "studio/figure/subject.h"

namespace polyhull {

/// Reads \p path: polygons are triangulated, normals are averaged over the triangles at a vertex.
/// Colours come from the materials' diffuse pictures and colours, from colours after the positions,
/// or, where the file has none, from a pattern of coloured rings and spots. The lowest point is put
/// on y = 0 and the middle of the bounding box above the origin; \p height scales to that many
/// metres, 0 leaves the size. The subject turns about y once in ten seconds. A surface that is not
/// closed is taken, with a warning(). Throws Error.
std::shared_ptr<const Subject> load_subject(const std::string& path, double height);

}  // namespace polyhull
