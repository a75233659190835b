// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: any bytes as key frames, and the viewport at some times.
#include <cmath>
#include <cstdlib>

#include "base/error.h"
#include "scene/key_frames.h"

using namespace polyhull;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const KeyFrames keys = parse_key_frames({reinterpret_cast<const char*>(data), size}, "fuzz");
    for (const double seconds : {-1.0, 0.0, 1e-6, 0.04, 0.5, 1.0, 2.5, 1e3, 1e6, 1e300}) {
      const KeyFrames::View view = keys.at(seconds);
      // Never beyond what key frames may tell.
      for (int i = 0; i < 3; ++i)
        if (!(std::abs(view.pose.eye[i]) <= 1e6) || !(std::abs(view.pose.target[i]) <= 1e6))
          std::abort();
      if (!(view.field_of_view >= 1.0 && view.field_of_view <= 170.0)) std::abort();
      if (view.shot >= keys.size()) std::abort();
    }
  } catch (const Error&) {
  }
  return 0;
}
