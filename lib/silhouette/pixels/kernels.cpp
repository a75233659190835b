// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/pixels/kernels.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "base/instruction_set.h"
#include "silhouette/pixels/choose_kernels.h"

namespace polyhull::silhouette {

Ramp with_sure_signals(Ramp ramp) {
  if (ramp.gain <= 0) return ramp;
  const auto to16 = [](std::int32_t v) {
    return static_cast<std::int16_t>(std::clamp(v, -32768, 32767));
  };
  // The difference is at most (that bound): alpha is at most low, and at least high from the
  // other on.
  const std::int32_t most = ((ramp.low + 1) * 32768 - 16384 - 1) / ramp.gain;
  const std::int32_t least = (ramp.high * 32768 - 16384 + ramp.gain - 1) / ramp.gain;
  if (most < 32767) ramp.empty_above = to16(ramp.base - most - 1);
  if (ramp.high > 0 && least <= 32767) ramp.full_below = to16(ramp.base - least + 1);
  return ramp;
}
namespace {

const Kernels& best_kernels() {
#if defined(__x86_64__)
  if (has_avx512()) return avx512_kernels();
  if (has_avx2()) return avx2_kernels();
  return baseline_kernels();
#else
  return plain_kernels();
#endif
}

}  // namespace

KernelChoice choose_kernels(const char* wanted) {
  const std::string_view name = wanted != nullptr ? wanted : "";
  if (name.empty()) return {best_kernels(), ""};
  if (name == "plain") return {plain_kernels(), ""};
#if defined(__x86_64__)
  if (name == "baseline") return {baseline_kernels(), ""};
  if (name == "avx2" && has_avx2()) return {avx2_kernels(), ""};
  if (name == "avx512" && has_avx512()) return {avx512_kernels(), ""};
#endif
  const bool known = name == "baseline" || name == "avx2" || name == "avx512";
  const Kernels& best = best_kernels();
  return {
      best,
      fmt::format("POLYHULL_ISA is '{}', which {}; {} is used. It takes plain, baseline, avx2 or "
                  "avx512, the last two where the processor has them; unset, the best is chosen.",
                  name, known ? "this machine does not have" : "is none of its values", best.name)};
}

const Kernels& kernels() {
  static const Kernels& chosen = []() -> const Kernels& {
    const KernelChoice choice = choose_kernels(std::getenv("POLYHULL_ISA"));
    if (!choice.complaint.empty()) std::fprintf(stderr, "polyhull: %s\n", choice.complaint.c_str());
    return choice.kernels;
  }();
  return chosen;
}

}  // namespace polyhull::silhouette
