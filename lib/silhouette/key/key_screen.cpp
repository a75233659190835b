// SPDX-License-Identifier: LGPL-2.1-or-later
// The ramps from signal to alpha: one for the whole picture, one for each span of tiles, or one for each pixel of a clean
// plate.
#include <algorithm>
#include <cmath>

#include "silhouette/key/key_state.h"

namespace polyhull {
namespace {

constexpr double least_range =
    8.0;  // levels between screen and foreground; keeps the gain in 16 bit

using silhouette::most_clipped;

}  // namespace

silhouette::Ramp Keyer::State::ramp_for(double screen, double foreground, double unit,
                                        double spread) const {
  const double range = std::max(screen - foreground, least_range);
  // At both ends, so that contours stay.
  const double clip = std::min(most_clipped, 2.5 * spread / range);
  const double low = std::max(black, clip),
               high = std::max(std::min(white, 1.0 - clip), low + 0.01);
  const double from = screen - low * range, levels = range * (high - low);
  const auto fixed = [](double v) {
    return static_cast<std::int16_t>(std::clamp(std::lround(v), -32767l, 32767l));
  };
  return {fixed(from * unit), fixed(255.0 * 32768.0 / (levels * unit)), whole.ramp.low,
          whole.ramp.high};
}

void Keyer::State::lay_out_screen() {
  local = false;
  if (method != KeyMethod::soft) return;
  const double range = std::max(screen_level - foreground_level, least_range);
  const bool plate_given = settings.plate || !learned_plate.empty();
  // What the screen's signal spreads beyond a camera's noise is clipped where it is not followed, and what
  // the subject's does, as spill near its outline makes it: at both ends, so that contours stay.
  const double clip = settings.screen && settings.foreground && !plate_given
                          ? std::min(3.0 * unevenness / range, most_clipped)
                          : clip_of_subject;
  black = std::max(settings.clip_black, clip);
  white = std::max(std::min(settings.clip_white, 1.0 - clip), black + 0.01);
  // Blocks of nothing but noise are silenced; edges keep their ramp, for clipping one side of a
  // mixed pixel's neighbours shifts the boundary.
  const double silence = std::clamp(2.5 * unquiet / (range * (white - black)), 0.03, 0.2);
  whole.ramp.low = static_cast<std::uint8_t>(std::lround(255.0 * silence));
  whole.ramp.high = static_cast<std::uint8_t>(std::lround(255.0 * (1.0 - silence - spread_inside)));
  whole.ramp = silhouette::with_sure_signals(ramp_for(screen_level, foreground_level, signal.unit));
  quiet = silhouette::quiet_for(whole.ramp.low, whole.ramp.high);
  if (!plate_given) return;

  local = true;
  lay_out_plate();
  const std::size_t length = row_length();
  base.assign(length * static_cast<std::size_t>(height), whole.ramp.base);
  gain.assign(length * static_cast<std::size_t>(height), whole.ramp.gain);
  const double step = screen_level - foreground_level;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const std::size_t at = length * static_cast<std::size_t>(y) + x;
      const std::uint8_t* p = plate.data() + 4 * at;
      // Where the plate shows no screen, only what is clearly no screen either can be told apart.
      const double screen = std::max(signal.of(p[0], p[1], p[2]), foreground_level + 0.3 * step);
      const silhouette::Ramp r = ramp_for(screen, foreground_level, signal.unit);
      base[at] = r.base;
      gain[at] = r.gain;
    }
}

}  // namespace polyhull
