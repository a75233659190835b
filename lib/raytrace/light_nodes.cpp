// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/light_nodes.h"

#include "raytrace/lamp_share.h"
#include "raytrace/sampling.h"

namespace polyhull {

bool inside_a_body(const TracedScene& scene, const SurfaceGrid::Node& node) {
  const auto [x, y] = tangents(node.normal);
  int backs = 0;
  constexpr std::uint32_t count = 8;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec3f local = cosine_direction(sample_point(i, bounce_seed));
    Ray ray;
    ray.origin = ray_start(scene, node);
    ray.near = 10.0f * scene.epsilon();
    ray.direction = local.x * x + local.y * y + local.z * node.normal;
    const RayHit hit = scene.caster().intersect(ray);
    if (!hit.hit()) continue;
    const Material& material = scene.scene().materials[scene.scene().meshes[hit.mesh].material];
    if (!material.double_sided && glm::dot(hit.normal, ray.direction) > 0.0f) ++backs;
  }
  return 2 * backs > static_cast<int>(count);
}

Float4 interpolate(const SurfaceGrid& grid, const std::vector<Float4>& values, const RayHit& hit) {
  const SurfaceGrid::Lookup lookup = grid.lookup(hit);
  return lookup.weight[0] * values[lookup.index[0]] + lookup.weight[1] * values[lookup.index[1]] +
         lookup.weight[2] * values[lookup.index[2]] + lookup.weight[3] * values[lookup.index[3]];
}

std::array<std::uint32_t, 4> corners(const SurfaceGrid::Block& block) {
  const std::uint32_t below = block.first + block.height * block.stride;
  return {block.first, block.first + block.width, below, below + block.width};
}

Float4 between(const std::vector<Float4>& values, const SurfaceGrid::Block& block, float x,
               float y) {
  const auto at = corners(block);
  return (1.0f - y) * ((1.0f - x) * values[at[0]] + x * values[at[1]]) +
         y * ((1.0f - x) * values[at[2]] + x * values[at[3]]);
}

}  // namespace polyhull
