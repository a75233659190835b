// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A mesh's views as a subject that is drawn without its triangles.
#pragma once

#include "imagehull/image_hull.h"
#include "mesh/mesh.h"

namespace polyhull {

/// Ready to be drawn; made once per instant.
struct ImageSubject {
  ImageHull hull;
  /// What is to be coloured, without triangles: the views (their pixels borrowed as the mesh borrows
  /// them, without contours), the corners of ImageHull as vertices around Hull::origin, and a
  /// texturing with an occlusion map for each view that may colour, found by sight_maps().
  Mesh mesh;
};

/// The subject of \p mesh's views, whose hull is not looked at. Method, metric, cameras and the unseen
/// surface's colour are those of its texturing; without one, blend of two by the viewing angle. Throws
/// Error as ImageHull's constructor.
ImageSubject image_subject(const Mesh& mesh);

}  // namespace polyhull
