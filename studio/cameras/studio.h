// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The coloured screen behind the subject: walls and floor without a seam, lit almost evenly.
#pragma once

#include <cstdint>
#include <vector>

#include "rig/camera.h"
#include "studio/cameras/coverage_raster.h"
#include "studio/figure/subject.h"

namespace polyhull {

/// How dark the subject makes the floor: a map over the stage, soft as under large lamps.
class FloorShadow {
 public:
  /// Fills the map for one instant from the surface's vertices and the middles of its triangles.
  void cast(const SubjectFrame& frame, const std::vector<std::uint32_t>& triangles);

  /// 0 (none) .. 1 (darkest) at the floor point (\p x, \p z) in metres; smooth.
  float at(float x, float z) const;

  /// Half the edge of the square, in metres, outside of which there is no shadow.
  static constexpr float reach = 2.0f;

 private:
  static constexpr int cells = 128;  // along an edge
  std::vector<float> map_;
  std::vector<float> scratch_;
};

/// What does not change from frame to frame in one camera's picture of the empty screen.
class Screen {
 public:
  struct Look {
    std::uint8_t colour[3] = {0, 0, 0};  ///< sRGB
    double unevenness = 0.0;             ///< relative fall of the light from its middle value
    bool operator==(const Look&) const = default;
  };

  /// Draws the empty screen as RGBx for \p camera, whose number in the rig \p index turns the
  /// gradient.
  void prepare(const Camera& camera, const Look& look, int index);

  /// Finds the floor point that each pixel sees; needed before shadows are added.
  void find_floor(const Camera& camera, const Placement& placement);
  bool has_floor() const { return !floor_.empty(); }

  const std::uint8_t* row(int y) const {
    return picture_.data() + static_cast<std::size_t>(y) * width_ * 4;
  }

  /// Darkens one row of an RGBx picture by \p strength times the shadow.
  void add_shadow(const FloorShadow& shadow, double strength, int y, std::uint8_t* pixels) const;

  /// The rows that see the part of the floor where there can be a shadow.
  int first_shadow_row() const { return first_row_; }
  int last_shadow_row() const { return last_row_; }

 private:
  struct FloorSpan {
    int begin = 0, end = 0;  // columns
  };
  int width_ = 0, height_ = 0;
  std::vector<std::uint8_t> picture_;
  std::vector<Vec2f> floor_;  // stage coordinates x, z of the floor that a pixel sees
  std::vector<FloorSpan> spans_;
  int first_row_ = 0, last_row_ = -1;
};

}  // namespace polyhull
