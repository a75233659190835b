// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The coloured screen behind the subject: walls and floor without a seam, lit almost evenly.
#pragma once

#include <cstdint>
#include <vector>

#include "rig/camera.h"
#include "studio/figure/floor_shadow.h"
#include "studio/figure/subject.h"

namespace polyhull {

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

  /// Finds the pixels that see \p shadow; needed before it is added.
  void find_shadow(const FloorShadow& shadow);

  /// Darkens one row of an RGBx picture by \p strength times the shadow.
  void add_shadow(const FloorShadow& shadow, double strength, int y, std::uint8_t* pixels) const;

 private:
  struct Span {
    int begin = 0, end = 0;  // columns
  };
  int width_ = 0, height_ = 0;
  std::vector<std::uint8_t> picture_;
  std::vector<Vec2f> floor_;  // stage coordinates x, z of the floor that a pixel sees
  std::vector<Span> spans_;   // that see the stage, of each row
  std::vector<Vec2f> nodes_;  // the same as floor_ on a coarse grid, 1e9 above the horizon
  int node_columns_ = 0;
  std::vector<Span> shadow_spans_;  // of each row of the grid's cells
};

}  // namespace polyhull
