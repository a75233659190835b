// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/figure/implicit_skin.h"

#include <algorithm>
#include <cmath>

namespace polyhull {
namespace {

float smooth_minimum(float a, float b, float k) {
  const float h = std::max(k - std::abs(a - b), 0.0f);
  return std::min(a, b) - h * h / (4.0f * k);
}

float smooth_maximum(float a, float b, float k) {
  return -smooth_minimum(-a, -b, k);
}

float distance_to_cone(const SkinBody& body, Vec3f p) {
  if (body.flatness != 1.0f)
    p += (1.0f / body.flatness - 1.0f) * glm::dot(p - body.a, body.squash) * body.squash;
  const Vec3f ba = body.b - body.a;
  const float l2 = glm::dot(ba, ba);
  const float rr = body.ra - body.rb;
  const float a2 = l2 - rr * rr;
  const float il2 = 1.0f / l2;
  const Vec3f pa = p - body.a;
  const float y = glm::dot(pa, ba);
  const float z = y - l2;
  const Vec3f q = pa * l2 - ba * y;
  const float x2 = glm::dot(q, q);
  const float y2 = y * y * l2;
  const float z2 = z * z * l2;
  const float k = (rr < 0.0f ? -1.0f : 1.0f) * rr * rr * x2;
  float d;
  if ((z < 0.0f ? -1.0f : 1.0f) * a2 * z2 > k)
    d = std::sqrt(x2 + z2) * il2 - body.rb;
  else if ((y < 0.0f ? -1.0f : 1.0f) * a2 * y2 < k)
    d = std::sqrt(x2 + y2) * il2 - body.ra;
  else
    d = (std::sqrt(x2 * a2 * il2) + y * rr) * il2 - body.ra;
  return body.flatness == 1.0f ? d : d * std::sqrt(body.flatness);
}

float distance_to_ellipsoid(const SkinBody& body, const Vec3f& p) {
  const Vec3f q = p - body.a;
  const float k0 = glm::length(q / body.b);
  const float k1 = glm::length(q / (body.b * body.b));
  return k1 > 1e-6f ? k0 * (k0 - 1.0f) / k1 : -std::min({body.b.x, body.b.y, body.b.z});
}

/// Is the distance from \p p to \p body certainly greater than \p distance?
bool out_of_reach(const SkinBody& body, const Vec3f& p, float distance) {
  const bool cone = body.kind == SkinBody::Kind::cone;
  const Vec3f centre = cone ? 0.5f * (body.a + body.b) : body.a;
  // What distance_to_body() says may fall short of the true distance by this factor.
  const float factor = cone ? std::sqrt(body.flatness) : 0.36f;
  const float radius = cone ? 0.5f * glm::length(body.b - body.a) + std::max(body.ra, body.rb)
                            : std::max({body.b.x, body.b.y, body.b.z});
  const float reach = radius + distance / factor;
  const Vec3f d = p - centre;
  return glm::dot(d, d) > reach * reach;
}

}  // namespace

float distance_to_body(const SkinBody& body, const Vec3f& p) {
  float d = body.kind == SkinBody::Kind::cone ? distance_to_cone(body, p)
                                              : distance_to_ellipsoid(body, p);
  if (body.above_floor) d = smooth_maximum(d, -p.y, 0.012f);
  if (body.cut < 1e8f) d = smooth_maximum(d, glm::dot(p, body.cut_normal) - body.cut, 0.012f);
  return d;
}

float skin_value(const std::vector<SkinBody>& bodies, const Vec3f& p) {
  float f = 1e9f;
  for (const SkinBody& body : bodies) {
    if (f < 1e8f && out_of_reach(body, p, std::max(f + body.blend, 0.0f))) continue;
    f = smooth_minimum(f, distance_to_body(body, p), body.blend);
  }
  return f;
}

Vec3f skin_gradient(const std::vector<SkinBody>& bodies, const Vec3f& p) {
  constexpr float h = 5e-4f;
  const auto along = [&](const Vec3f& e) {
    return skin_value(bodies, p + e) - skin_value(bodies, p - e);
  };
  return Vec3f(along({h, 0, 0}), along({0, h, 0}), along({0, 0, h})) / (2.0f * h);
}

Vec3f rough_skin_gradient(const std::vector<SkinBody>& bodies, const Vec3f& p) {
  constexpr float h = 5e-4f;
  Vec3f sum(0.0f);
  for (const Vec3f& e : {Vec3f(1, -1, -1), Vec3f(-1, -1, 1), Vec3f(-1, 1, -1), Vec3f(1, 1, 1)})
    sum += e * skin_value(bodies, p + e * h);
  return sum / (4.0f * h);
}

}  // namespace polyhull
