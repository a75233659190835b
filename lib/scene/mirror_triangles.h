// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which triangles make a scene's planar mirrors.
#pragma once

#include <cstddef>
#include <vector>

#include "scene/scene.h"

namespace polyhull {

/// In which of Scene::mirrors each triangle of mesh \p mesh lies; -1: in none.
std::vector<int> mirrors_of_triangles(const Scene& scene, std::size_t mesh);

}  // namespace polyhull
