// SPDX-License-Identifier: LGPL-2.1-or-later
#include "view/scene_planes.h"

#include "base/content_hash.h"

namespace polyhull {

std::uint64_t geometry_key(const Scene& scene) {
  ContentHash hash;
  for (const SceneMesh& mesh : scene.meshes) {
    hash.add(mesh.positions);
    hash.add(mesh.triangles);
  }
  return hash.value();
}

}  // namespace polyhull
