// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: any bytes as a lens file, and what it tells at some values of the encoders.
#include <cmath>
#include <cstdlib>

#include "base/error.h"
#include "track/lens/lens_table.h"
#include "track/tracked_pose.h"

using namespace polyhull;

static void check(double value, double least, double most) {
  if (!(value >= least && value <= most)) std::abort();
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const LensTable lens({reinterpret_cast<const char*>(data), size}, "fuzz");
    for (const double zoom : {-1e9, 0.0, 0.5, 1e3, 1e300})
      for (const double focus : {-1.0, 0.25, 7.0}) {
        const LensState state = lens.at({zoom, focus});
        // Never beyond what rows may tell.
        check(state.focal_length_mm.value_or(1.0), 0.0999, 1.0001e5);
        check(state.focal_length_widths.value_or(1.0), 1e-3, 1e4);
        check(state.focus_distance_m.value_or(1.0), 0.999e-3, LensTable::farthest_m);
        check(state.entrance_pupil_m.value_or(0.0), -100.01, 100.01);
        for (const double k : state.distortion) check(k, -1.0001e6, 1.0001e6);
        TrackedPose pose;
        add_lens(pose, state, false);
        camera_of(pose, 640, 480, 40.0);
      }
  } catch (const Error&) {
  }
  return 0;
}
