// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How dark a subject makes the floor: a map over the stage, soft as under large lamps.
#pragma once

#include <cstdint>
#include <vector>

#include "studio/figure/subject.h"

namespace polyhull {

class FloorShadow {
 public:
  /// Fills the map for one instant from the surface's vertices and the middles of its triangles.
  FloorShadow(const SubjectFrame& frame, const std::vector<std::uint32_t>& triangles);

  /// 0 (none) .. 1 (darkest) at the floor point (\p x, \p z) in metres; smooth.
  float at(float x, float z) const {
    constexpr float per_metre = cells / (2.0f * reach);
    const float u = (x + reach) * per_metre - 0.5f, v = (z + reach) * per_metre - 0.5f;
    if (!(u >= 0.0f && v >= 0.0f && u < cells - 1 && v < cells - 1)) return 0.0f;
    const int i = static_cast<int>(u), j = static_cast<int>(v);
    const float fu = u - static_cast<float>(i), fv = v - static_cast<float>(j);
    const float* m = map_.data() + static_cast<std::size_t>(j) * cells + i;
    return (m[0] * (1 - fu) + m[1] * fu) * (1 - fv) +
           (m[cells] * (1 - fu) + m[cells + 1] * fu) * fv;
  }

  /// Whether the floor point (x, z) may be so dark that an 8-bit level changes.
  bool reaches(const Vec2f& p) const {
    return p.x > low_.x && p.y > low_.y && p.x < high_.x && p.y < high_.y;
  }

  /// The rectangle of the floor (x, z) outside of which none is.
  const Vec2f& low() const { return low_; }
  const Vec2f& high() const { return high_; }

  /// Half the edge of the square, in metres, outside of which there is no shadow.
  static constexpr float reach = 2.0f;

 private:
  static constexpr int cells = 128;  // along an edge
  std::vector<float> map_;
  Vec2f low_{0.0f}, high_{0.0f};
};

}  // namespace polyhull
