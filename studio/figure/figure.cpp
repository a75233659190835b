// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/figure/figure.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>

#include "base/thread_pool.h"
#include "studio/figure/polygonise.h"

namespace polyhull {
namespace {

/// q0 rotates, qe carries the translation: qe = 0.5 t q0.
struct DualQuaternion {
  glm::quat q0;
  glm::quat qe;
};

DualQuaternion dual_quaternion(const RigidMotion& motion) {
  const glm::dquat q = glm::quat_cast(motion.rotation);
  const glm::dquat e = glm::dquat(0.0, motion.translation) * q * 0.5;
  return {glm::quat(q), glm::quat(e)};
}

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

}  // namespace

Figure::Figure(float step) {
  const std::vector<SkinBody> bodies = figure_bodies();
  const auto value = [&](const Vec3f& p) { return skin_value(bodies, p); };
  const auto gradient = [&](const Vec3f& p) { return skin_gradient(bodies, p); };
  TriangleMesh mesh = polygonise(value, {-0.74f, -0.04f, -0.26f}, {0.74f, 1.82f, 0.24f}, step);
  relax(
      mesh, value, [&](const Vec3f& p) { return rough_skin_gradient(bodies, p); }, 5);

  rest_positions_ = std::move(mesh.vertices);
  triangles_ = std::move(mesh.triangles);
  vertex_count_ = rest_positions_.size();
  rest_normals_.resize(vertex_count_);
  openness_.resize(vertex_count_);
  bones_.resize(vertex_count_);
  weights_.resize(vertex_count_);
  parallel_for(vertex_count_, 256, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3f& p = rest_positions_[i];
      rest_normals_[i] = glm::normalize(gradient(p));
      openness_[i] = openness(bodies, p, rest_normals_[i]);
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
      for (int k = 0; k < influences; ++k) {
        const float excess = (nearest[order[k]] - least) / softness(order[0]);
        const float w = std::max(std::exp(-excess) - 0.02f, 0.0f);
        bones_[i][k] = static_cast<std::uint8_t>(order[k]);
        weights_[i][k] = w;
        sum += w;
      }
      for (float& w : weights_[i]) w /= sum;
    }
  });
}

void Figure::pose(double seconds, SubjectFrame& frame) const {
  const Pose pose = pose_at(seconds);
  std::array<DualQuaternion, bone_count> bones;
  for (int b = 0; b < bone_count; ++b) bones[b] = dual_quaternion(pose[b]);
  frame.positions.resize(vertex_count_);
  frame.normals.resize(vertex_count_);
  parallel_for(vertex_count_, 4096, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const DualQuaternion& first = bones[bones_[i][0]];
      glm::quat q0 = first.q0 * weights_[i][0];
      glm::quat qe = first.qe * weights_[i][0];
      for (int k = 1; k < influences; ++k) {
        const float w = weights_[i][k];
        if (w <= 0.0f) break;
        const DualQuaternion& bone = bones[bones_[i][k]];
        // q and -q are the same motion; take the one nearer to the first bone's.
        const float s = glm::dot(first.q0, bone.q0) < 0.0f ? -w : w;
        q0 = q0 + bone.q0 * s;
        qe = qe + bone.qe * s;
      }
      const float length = glm::length(q0);
      q0 = q0 / length;
      qe = qe / length;
      const Vec3f v0(q0.x, q0.y, q0.z), ve(qe.x, qe.y, qe.z);
      const Vec3f shift = 2.0f * (q0.w * ve - qe.w * v0 + glm::cross(v0, ve));
      frame.positions[i] = q0 * rest_positions_[i] + shift;
      frame.normals[i] = q0 * rest_normals_[i];
    }
  });
}

Vec3f Figure::albedo(std::uint32_t triangle, const Vec3f& at, float width) const {
  const std::uint32_t* v = &triangles_[3 * static_cast<std::size_t>(triangle)];
  const Vec3f p =
      rest_positions_[v[0]] * at.x + rest_positions_[v[1]] * at.y + rest_positions_[v[2]] * at.z;
  const float open = openness_[v[0]] * at.x + openness_[v[1]] * at.y + openness_[v[2]] * at.z;
  return figure_albedo(p, width) * open;
}

}  // namespace polyhull
