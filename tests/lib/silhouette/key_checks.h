// SPDX-License-Identifier: LGPL-2.1-or-later
// A subject before a screen, keyed, for the keyer's tests.
#pragma once

#include <cmath>
#include <functional>

#include "silhouette/key/key.h"
#include "silhouette_checks.h"
#include "silhouette_frames.h"

namespace polyhull::test {

inline constexpr Colour screen_green{60, 190, 70};
inline constexpr Colour skin{190, 130, 110};

inline Colour mix(const Colour& a, const Colour& b, double t) {
  return {a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t};
}

inline Rgb rgb(const Colour& c) {
  return {static_cast<std::uint8_t>(c[0]), static_cast<std::uint8_t>(c[1]),
          static_cast<std::uint8_t>(c[2])};
}

// A disk of skin on a green screen, its edge mixed by coverage.
inline Colour disk_scene(int x, int y) {
  return mix(screen_green, skin, std::clamp(30.5 - std::hypot(x - 60.0, y - 45.0), 0.0, 1.0));
}

inline Matte key(const KeySettings& settings, const FrameView& frame) {
  Keyer keyer;
  keyer.set(settings);
  Matte matte;
  keyer.key(frame, matte);
  return matte;
}

inline double area_of(const Matte& m) {
  double sum = 0.0;
  for (int y = 0; y < m.height; ++y)
    for (int x = 0; x < m.width; ++x) sum += m.row(y)[x] / 255.0;
  return sum;
}

inline Matte matte_of(int width, int height, const std::function<int(int, int)>& alpha) {
  Matte matte;
  matte.resize(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) matte.row(y)[x] = static_cast<std::uint8_t>(alpha(x, y));
    find_states(matte.row(y), width, matte.state_row(y));
  }
  return matte;
}

}  // namespace polyhull::test
