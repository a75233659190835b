// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/figure/figure_skin.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/thread_pool.h"
#include "studio/figure/implicit_skin.h"
#include "studio/figure/polygons/coarsen.h"
#include "studio/figure/polygons/polygonise.h"
#include "studio/figure/skeleton.h"

namespace polyhull {
namespace {

/// Metres over which the hold of a bone fades at the joints of \p bone: short at limbs, long at the
/// trunk.
float softness(int bone) {
  if (bone >= bone_left_thigh) return 0.016f;
  return bone >= bone_left_upper_arm ? 0.012f : 0.024f;
}

/// Which part of the half sphere over \p p is free, judged by how fast the skin's value grows along
/// the normal (Evans, "Fast approximations for global illumination on dynamic scenes", 2006).
float openness(const std::vector<SkinBody>& bodies, const Vec3f& p, const Vec3f& n) {
  float closed = 0.0f;
  float weight = 1.0f;
  for (const float reach : {0.02f, 0.045f, 0.08f, 0.13f}) {
    closed += weight * std::max(reach - skin_value(bodies, p + n * reach), 0.0f) / reach;
    weight *= 0.6f;
  }
  return std::clamp(1.0f - 0.42f * closed, 0.25f, 1.0f);
}

/// The skin whose surface is \p mesh.
FigureSkin skin_on(const std::vector<SkinBody>& bodies, TriangleMesh mesh) {
  FigureSkin skin;
  skin.positions = std::move(mesh.vertices);
  skin.triangles = std::move(mesh.triangles);
  const std::size_t count = skin.positions.size();
  skin.normals.resize(count);
  skin.openness.resize(count);
  skin.bones.resize(count);
  skin.weights.resize(count);
  parallel_each(count, 256, 0, [&](std::size_t i) {
    const Vec3f& p = skin.positions[i];
    skin.normals[i] = glm::normalize(skin_gradient(bodies, p));
    skin.openness[i] = openness(bodies, p, skin.normals[i]);
    // A bone holds a vertex the more, the nearer one of its bodies is.
    std::array<float, bone_count> nearest;
    nearest.fill(1e9f);
    for (const SkinBody& body : bodies)
      nearest[body.bone] = std::min(nearest[body.bone], distance_to_body(body, p));
    const float least = *std::min_element(nearest.begin(), nearest.end());
    std::array<int, bone_count> order;
    for (int b = 0; b < bone_count; ++b) order[b] = b;
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return nearest[a] < nearest[b]; });
    float sum = 0.0f;
    for (int k = 0; k < FigureSkin::influences; ++k) {
      const float excess = (nearest[order[k]] - least) / softness(order[0]);
      const float w = std::max(std::exp(-excess) - 0.02f, 0.0f);
      skin.bones[i][k] = static_cast<std::uint8_t>(order[k]);
      skin.weights[i][k] = w;
      sum += w;
    }
    for (float& w : skin.weights[i]) w /= sum;
  });
  return skin;
}

}  // namespace

FigureSkin make_figure_skin(float step) {
  const std::vector<SkinBody> bodies = figure_bodies();
  const auto value = [&](const Vec3f& p) { return skin_value(bodies, p); };
  TriangleMesh mesh = polygonise(value, {-0.74f, -0.04f, -0.26f}, {0.74f, 1.82f, 0.24f}, step);
  relax(
      mesh, value, [&](const Vec3f& p) { return rough_skin_gradient(bodies, p); }, 5);
  return skin_on(bodies, std::move(mesh));
}

FigureSkin coarser_figure_skin(const FigureSkin& skin, std::size_t triangles) {
  // Where bones share the surface it bends: a vertex that changes them counts as moved so far.
  constexpr float bend = 0.01f;
  std::vector<float> held(skin.positions.size() * bone_count, 0.0f);
  for (std::size_t i = 0; i < skin.positions.size(); ++i)
    for (int k = 0; k < FigureSkin::influences; ++k)
      held[i * bone_count + skin.bones[i][k]] = bend * skin.weights[i][k];
  TriangleMesh mesh{skin.positions, skin.triangles};
  coarsen(mesh, triangles, held, bone_count);
  return skin_on(figure_bodies(), std::move(mesh));
}

}  // namespace polyhull
