// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/loops/loops.h"

#include <cmath>

#include "base/srgb.h"

namespace polyhull::processor {

const SrgbLines& srgb_lines() {
  static const SrgbLines lines = [] {
    SrgbLines made;
    const auto byte = [](double light) { return 255.0 * srgb_encoded(light) + 0.5; };
    for (int i = 0; i < SrgbLines::steps; ++i) {
      const double octave = std::exp2(i / 16 - SrgbLines::octaves);
      const double a = octave * (1.0 + i % 16 / 16.0), b = a + octave / 16.0;
      const double slope = (byte(b) - byte(a)) / (b - a), bias = byte(a) - slope * a;
      const double middle = 0.5 * (a + b);
      made.slope[i] = static_cast<float>(slope);
      // The curve lies above its chords.
      made.bias[i] = static_cast<float>(bias + 0.5 * (byte(middle) - bias - slope * middle));
    }
    return made;
  }();
  return lines;
}

}  // namespace polyhull::processor
