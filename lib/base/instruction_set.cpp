// SPDX-License-Identifier: LGPL-2.1-or-later
#include "base/instruction_set.h"

#include <cstdlib>
#include <string_view>

namespace polyhull {

bool has_avx2() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
         __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("fma");
#else
  return false;
#endif
}

bool has_avx512() {
#if defined(__x86_64__)
  return has_avx2() && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd") &&
         __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
         __builtin_cpu_supports("avx512vnni");
#else
  return false;
#endif
}

bool may_use_avx2() {
  const char* text = std::getenv("POLYHULL_ISA");
  const std::string_view wanted = text != nullptr ? text : "";
  return wanted != "baseline" && wanted != "plain" && has_avx2();
}

}  // namespace polyhull
