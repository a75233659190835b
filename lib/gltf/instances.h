// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Where the nodes of a glTF file put their meshes.
#pragma once

#include "base/vector.h"
#include "gltf/accessor.h"
#include "gltf/node_transform.h"

namespace polyhull {

/// The parts of \p node's own transform; a matrix that it has instead does not count.
NodeTransform transform_parts(const tinygltf::Node& node);

/// \p node's own transform, from its coordinates to its parent's. Throws Error for numbers that are
/// not finite.
Mat4 local_transform(const GltfSource& source, const tinygltf::Node& node);

/// The transforms of the node's mesh before its own: one that changes nothing, or those of
/// EXT_mesh_gpu_instancing (TRANSLATION, ROTATION, SCALE; its other attributes are passed over).
/// Throws Error for attributes that differ in length, too many instances, and numbers that are not
/// finite.
std::vector<Mat4> instance_transforms(const GltfSource& source, const tinygltf::Node& node);

}  // namespace polyhull
