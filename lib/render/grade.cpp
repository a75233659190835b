// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/grade.h"

#include <algorithm>
#include <cmath>

#include "base/srgb.h"

namespace polyhull {

Vec3f graded(const Grade& grade, const Vec3f& linear) {
  Vec3f v = glm::clamp(grade.slope * linear + grade.offset, Vec3f(0.0f), Vec3f(1.0f));
  for (int c = 0; c < 3; ++c)
    if (grade.power[c] != 1.0f) v[c] = std::pow(v[c], grade.power[c]);
  const float y = glm::dot(luminance_weights<float>, v);
  return glm::clamp(Vec3f(y) + grade.saturation * (v - Vec3f(y)), Vec3f(0.0f), Vec3f(1.0f));
}

}  // namespace polyhull
