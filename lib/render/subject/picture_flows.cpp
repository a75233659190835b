// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/subject/picture_flows.h"

#include <algorithm>
#include <cmath>

namespace polyhull {
namespace {

/// 0 where there is no way.
double angle(const Vec3& a, const Vec3& b) {
  const double lengths = glm::length(a) * glm::length(b);
  return lengths > 0.0 ? std::acos(std::clamp(glm::dot(a, b) / lengths, -1.0, 1.0)) : 0.0;
}

}  // namespace

float flow_share(const Mesh& mesh, const PictureFlow& flow, const Vec3& eye) {
  Vec3f low(0.0f), high(0.0f);
  if (!mesh.hull.vertices.empty()) low = high = mesh.hull.vertices.front();
  for (const Vec3f& v : mesh.hull.vertices) {
    low = glm::min(low, v);
    high = glm::max(high, v);
  }
  const Vec3 middle = mesh.hull.origin + Vec3(0.5f * (low + high));
  const auto from_eye = [&](int view) {
    return angle(mesh.views[static_cast<std::size_t>(view)].calibration.centre() - middle,
                 eye - middle);
  };
  const double own = from_eye(flow.view), sum = own + from_eye(flow.other);
  return sum > 0.0 ? static_cast<float>(own / sum) : 0.5f;
}

}  // namespace polyhull
