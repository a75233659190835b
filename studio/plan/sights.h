// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What each of many cameras shows of the figure on the stage, so stored that a set of cameras is
/// judged in microseconds.
///
/// Before each of some thousand points of the figure's surface stand probes along the normal, up to
/// a quarter of a metre away. A camera that sees past the figure at a probe shows that there is
/// nothing; the first probe that any camera of a set shows to be empty is how far the hull of the
/// set stands off the surface there. And a camera that sees the point gives it a colour, the better
/// the less its view grazes the surface.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "studio/plan/stage.h"

namespace polyhull {

/// Millimetres off the surface.
inline constexpr std::array<double, 8> probe_heights = {2, 5, 10, 20, 40, 80, 150, 250};

/// A point of a body's surface.
struct SurfacePoint {
  Vec3 at{0.0}, normal{0.0};
  std::uint32_t body = 0;
};

/// \p count points of each of \p bodies, spread evenly over the area; the same in each call.
std::vector<SurfacePoint> surface_points(const std::vector<StageBody>& bodies, std::size_t count);

/// What one camera, or several together, show of the points.
struct Sight {
  /// Per point: bit k is set where the probe at probe_heights[k] is seen to be empty.
  std::vector<std::uint8_t> empty;
  /// Per point: 255 times the cosine between the normal and the direction to the camera that sees
  /// it best, 0 where none does.
  std::vector<std::uint8_t> facing;
  bool operator==(const Sight&) const = default;
};

/// Nothing seen of \p points points.
Sight no_sight(std::size_t points);
/// Adds what \p other shows to \p sight.
void add(const Sight& other, Sight& sight);

/// What each of \p cameras shows. What is outside its picture it says nothing about. Works on
/// all threads of the pool.
std::vector<Sight> sights_of(const std::vector<Camera>& cameras,
                             const std::vector<StageBody>& bodies,
                             const std::vector<SurfacePoint>& points);

/// How wrong cameras are that show so much.
struct SightError {
  double hull = 0.0;    ///< mm: how far the hull stands off the surface, mean over the points
  double unseen = 0.0;  ///< share of the points without a colour; grazing views count in part
  /// An unseen point is as bad as a hull so far off. Less, and plans leave a side without colour (0)
  /// or stay the same (10 to 80).
  static constexpr double unseen_mm = 40.0;
  /// What plans make least, mm.
  double cost() const { return hull + unseen_mm * unseen; }
};
SightError error_of(const Sight& sight);
/// The cost() of the two together, without making the sum.
double cost_of(const Sight& a, const Sight& b);

}  // namespace polyhull
