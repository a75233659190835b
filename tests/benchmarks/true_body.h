// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A body whose surface is known, and what cameras see of it.
#pragma once

#include <string>

#include "base/picture.h"
#include "rig/camera.h"
#include "support/surface.h"

namespace polyhull::test {

/// Reads an OBJ file's faces, polygons fanned. Throws Error when it cannot be read.
TriangleSurface load_surface(const std::string& path);

/// What \p camera sees of \p surface: 0..255 by coverage, each pixel sampled \p samples x \p
/// samples times.
Picture mask_of(const TriangleSurface& surface, const Camera& camera, int samples);

/// Pixels of both over pixels of either, at half coverage.
double intersection_over_union(const Picture& a, const Picture& b);

}  // namespace polyhull::test
