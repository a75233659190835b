// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What cameras see of a mesh, by rays: what texturing's visibility is held against.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "hull/hull.h"
#include "rig/camera.h"

namespace polyhull::test {

/// The synthetic figure at 3 s as a closed mesh of about 36,000 triangles: as dense as a refined
/// surface.
Hull dense_body();

/// Per view and triangle (view-major) the share of the triangle's area that the view sees: it faces
/// the view (a cosine of more than .001), lies in its frame and nothing of the mesh is before it. By rays through 512 points
/// spread over the triangle; 24 where those agree.
std::vector<float> seen_by_rays(const Hull& hull, std::span<const Camera> cameras);

/// How much of the visible area is judged right: 1 - sum(a |share - truth|) / sum(a truth) over all
/// triangles of area a and all views.
double agreement(const Hull& hull, std::size_t views, std::span<const float> truth,
                 const std::function<float(std::size_t view, std::size_t triangle)>& share);

}  // namespace polyhull::test
