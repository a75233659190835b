// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/figure/figure.h"

#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <utility>

#include "base/thread_pool.h"

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

}  // namespace

Figure::Figure(FigureSkin skin, std::shared_ptr<const Figure> coarser, float pixel)
    : skin_(std::move(skin)) {
  coarser_ = std::move(coarser);
  coarser_pixel_ = pixel;
  triangles_ = std::move(skin_.triangles);
  vertex_count_ = skin_.positions.size();
  for (std::size_t i = 0; i < vertex_count_; ++i)
    painted_.emplace_back(skin_.positions[i], skin_.openness[i]);
}

void Figure::pose(double seconds, SubjectFrame& frame) const {
  const Pose pose = pose_at(seconds);
  std::array<DualQuaternion, bone_count> bones;
  for (int b = 0; b < bone_count; ++b) bones[b] = dual_quaternion(pose[b]);
  frame.positions.resize(vertex_count_);
  frame.normals.resize(vertex_count_);
  parallel_each(vertex_count_, 4096, 0, [&](std::size_t i) {
    const DualQuaternion& first = bones[skin_.bones[i][0]];
    glm::quat q0 = first.q0 * skin_.weights[i][0];
    glm::quat qe = first.qe * skin_.weights[i][0];
    for (int k = 1; k < FigureSkin::influences; ++k) {
      const float w = skin_.weights[i][k];
      if (w <= 0.0f) break;
      const DualQuaternion& bone = bones[skin_.bones[i][k]];
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
    frame.positions[i] = q0 * skin_.positions[i] + shift;
    frame.normals[i] = q0 * skin_.normals[i];
  });
}

Vec3f Figure::albedo(std::uint32_t triangle, const Vec3f& at, float width) const {
  const std::uint32_t* v = &triangles_[3 * static_cast<std::size_t>(triangle)];
  const glm::vec4 p = painted_[v[0]] * at.x + painted_[v[1]] * at.y + painted_[v[2]] * at.z;
  return figure_albedo(Vec3f(p), width) * p.w;
}

}  // namespace polyhull
