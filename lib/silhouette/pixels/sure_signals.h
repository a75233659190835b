// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which signals tell that a pixel is plainly screen or plainly subject. Internal.
#pragma once

#include <algorithm>

#include "silhouette/pixels/kernels.h"

namespace polyhull::silhouette {
namespace {  // compiled for each instruction set: no variant may stand in for another

/// Signals above `empty_above` have an alpha of ramp.low at most, signals below `full_below` one of
/// ramp.high at least: Ramp's formula solved for the signal.
struct SureSignals {
  std::int16_t empty_above = 32767, full_below = -32768;
  explicit SureSignals(Ramp ramp) {
    if (ramp.gain <= 0) return;
    const auto to16 = [](std::int32_t v) {
      return static_cast<std::int16_t>(std::clamp(v, -32768, 32767));
    };
    // The difference is at most (that bound): alpha is at most low, and at least high from the
    // other on.
    const std::int32_t most = ((ramp.low + 1) * 32768 - 16384 - 1) / ramp.gain;
    const std::int32_t least = (ramp.high * 32768 - 16384 + ramp.gain - 1) / ramp.gain;
    if (most < 32767) empty_above = to16(ramp.base - most - 1);
    if (ramp.high > 0 && least <= 32767) full_below = to16(ramp.base - least + 1);
  }
};

}  // namespace
}  // namespace polyhull::silhouette
