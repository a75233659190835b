// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/loops.h"

#include <cstdlib>
#include <string_view>

namespace polyhull::processor {

const Loops& loops() {
  static const Loops& chosen = []() -> const Loops& {
#if defined(__x86_64__)
    // What POLYHULL_ISA may be, and what is said about other values: silhouette/pixels/kernels.cpp.
    const char* text = std::getenv("POLYHULL_ISA");
    const std::string_view wanted = text != nullptr ? text : "";
    const bool refused = wanted == "baseline" || wanted == "plain";
    if (!refused && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
        __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("fma"))
      return avx2_loops();
#endif
    return baseline_loops();
  }();
  return chosen;
}

}  // namespace polyhull::processor
