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

std::shared_ptr<const SceneOnScreen> ready_triangles(const ScenePlanes* planes, const Scene& scene,
                                                     std::optional<std::uint64_t>& key,
                                                     const Mat4& pixels_from_scene, int width,
                                                     int height) {
  if (!planes) return nullptr;
  if (!key) key = geometry_key(scene);
  return planes->are_of(*key, pixels_from_scene, width, height) ? planes->triangles : nullptr;
}

}  // namespace polyhull
