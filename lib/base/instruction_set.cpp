// SPDX-License-Identifier: LGPL-2.1-or-later
#include "base/instruction_set.h"

#include <cstdlib>
#include <string_view>

namespace polyhull {

bool may_use_avx2() {
#if defined(__x86_64__)
  const char* text = std::getenv("POLYHULL_ISA");
  const std::string_view wanted = text != nullptr ? text : "";
  if (wanted == "baseline" || wanted == "plain") return false;
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
         __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("fma");
#else
  return false;
#endif
}

}  // namespace polyhull
