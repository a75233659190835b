// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Materials of a glTF file, with the pictures that they use, as materials and textures of a Scene.
#pragma once

#include "gltf/accessor.h"
#include "scene/scene.h"

namespace polyhull {

/// Appends the file's materials to \p scene, in their order, and their base colour pictures, each
/// once. Throws Error for numbers that are not finite or below 0 and for pictures that are missing
/// or cannot be decoded.
void add_materials(const GltfSource& source, Scene& scene);

}  // namespace polyhull
