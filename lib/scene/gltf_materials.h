// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Materials of a glTF file, with the pictures that they use, as materials and textures of a Scene.
#pragma once

#include <set>
#include <string>

#include "gltf/accessor.h"
#include "scene/scene.h"

namespace polyhull {

/// Appends the file's materials to \p scene, in their order, and their base colour pictures, each
/// once; emission is the factor times the mean of the emissive picture. What materials ask for and
/// nothing draws goes into \p left_out, in words. Throws Error for numbers that are not finite or
/// below 0 and for pictures that are missing or cannot be decoded.
void add_materials(const GltfSource& source, Scene& scene, std::set<std::string>& left_out);

/// The number of the texture coordinates (TEXCOORD_n) that \p material, of the file, uses.
int texture_set(const GltfSource& source, int material);

/// Moves the texture coordinates of \p mesh as \p material of the file asks by KHR_texture_transform.
void apply_texture_transform(const GltfSource& source, int material, SceneMesh& mesh);

}  // namespace polyhull
