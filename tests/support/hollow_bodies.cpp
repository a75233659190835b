// SPDX-License-Identifier: LGPL-2.1-or-later
#include "support/hollow_bodies.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "studio/figure/polygons/polygonise.h"

namespace polyhull::test {
namespace {

using Level = std::function<float(const Vec3f&)>;

/// 0..1, one random number at each node of a lattice.
float at_node(int x, int y, int z) {
  std::uint32_t h = static_cast<std::uint32_t>(x) * 0x8da6b343u ^
                    static_cast<std::uint32_t>(y) * 0xd8163841u ^
                    static_cast<std::uint32_t>(z) * 0xcb1ab31fu;
  h = (h ^ h >> 15) * 0x2c1b3c6du;
  h = (h ^ h >> 12) * 0x297a2d39u;
  return static_cast<float>((h ^ h >> 15) >> 8) * 0x1p-24f;
}

/// Smooth between the nodes.
float noise(const Vec3f& p) {
  const Vec3f low = glm::floor(p), f = p - low;
  const Vec3f t = f * f * (3.0f - 2.0f * f);
  const int x = static_cast<int>(low.x), y = static_cast<int>(low.y), z = static_cast<int>(low.z);
  float sum = 0.0f;
  for (int k = 0; k < 8; ++k) {
    const int i = k & 1, j = k >> 1 & 1, l = k >> 2;
    sum += (i ? t.x : 1 - t.x) * (j ? t.y : 1 - t.y) * (l ? t.z : 1 - t.z) *
           at_node(x + i, y + j, z + l);
  }
  return sum;
}

/// What is in both, with an edge rounded over \p width.
float both(float a, float b, float width = 0.03f) {
  const float h = std::max(width - std::abs(a - b), 0.0f);
  return std::max(a, b) + h * h / (4.0f * width);
}

float box(const Vec3f& p, const Vec3f& low, const Vec3f& high, float round) {
  const Vec3f q = glm::abs(p - 0.5f * (low + high)) - 0.5f * (high - low) + round;
  return glm::length(glm::max(q, Vec3f(0.0f))) + std::min(std::max({q.x, q.y, q.z}), 0.0f) - round;
}

float dented(const Vec3f& p) {
  const Vec3f on_axis(0.0f, std::clamp(p.y, 0.33f, 1.4f), 0.0f);
  float f = glm::distance(p, on_axis) - 0.3f;
  for (int k = 0; k < 5; ++k) {
    const float angle = 2.4f * static_cast<float>(k);  // radians: all around
    const Vec3f centre(0.42f * std::cos(angle), 0.5f + 0.2f * static_cast<float>(k),
                       0.42f * std::sin(angle));
    f = both(f, 0.22f - glm::distance(p, centre));
  }
  return f;
}

float armchair(const Vec3f& p) {
  const float seat = box(p, {-0.35f, 0.03f, -0.35f}, {0.35f, 0.45f, 0.35f}, 0.04f);
  const float back = box(p, {-0.35f, 0.03f, -0.38f}, {0.35f, 1.05f, -0.2f}, 0.06f);
  const float left = box(p, {-0.38f, 0.03f, -0.35f}, {-0.25f, 0.65f, 0.35f}, 0.05f);
  const float right = box(p, {0.25f, 0.03f, -0.35f}, {0.38f, 0.65f, 0.35f}, 0.05f);
  return -both(both(-seat, -back), both(-left, -right));
}

class HollowBody : public Subject {
 public:
  explicit HollowBody(const Level& level) {
    const auto gradient = [&](const Vec3f& p) {
      constexpr float h = 0.002f;
      return Vec3f(level(p + Vec3f(h, 0, 0)) - level(p - Vec3f(h, 0, 0)),
                   level(p + Vec3f(0, h, 0)) - level(p - Vec3f(0, h, 0)),
                   level(p + Vec3f(0, 0, h)) - level(p - Vec3f(0, 0, h))) /
             (2.0f * h);
    };
    TriangleMesh mesh = polygonise(level, {-0.6f, -0.06f, -0.6f}, {0.6f, 1.8f, 0.6f}, 0.012f);
    relax(mesh, level, gradient, 3);
    frame_.positions = std::move(mesh.vertices);
    triangles_ = std::move(mesh.triangles);
    vertex_count_ = frame_.positions.size();
    for (const Vec3f& p : frame_.positions) frame_.normals.push_back(glm::normalize(gradient(p)));
  }
  void pose(double, SubjectFrame& frame) const override { frame = frame_; }
  Vec3f albedo(std::uint32_t triangle, const Vec3f& at, float) const override {
    Vec3f p(0.0f);
    for (int k = 0; k < 3; ++k) p += at[k] * frame_.positions[triangles_[3 * triangle + k]];
    const float grain = 0.6f * noise(p / 0.03f) + 0.4f * noise(p / 0.07f + 100.0f);
    return Vec3f(0.1f) + std::clamp(1.6f * grain - 0.3f, 0.0f, 1.0f) * Vec3f(0.75f, 0.65f, 0.5f);
  }

 private:
  SubjectFrame frame_;
};

}  // namespace

std::vector<Body> hollow_bodies() {
  return {{"dented", std::make_shared<HollowBody>(dented), 0.0},
          {"armchair", std::make_shared<HollowBody>(armchair), 0.0}};
}

}  // namespace polyhull::test
