// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/pixels/kernels.h"

#include <cstdlib>
#include <cstring>

namespace polyhull::silhouette {
namespace {

const Kernels& choose() {
  const char* wanted = std::getenv("POLYHULL_ISA");
  if (wanted && std::strcmp(wanted, "plain") == 0) return plain_kernels();
#if defined(__x86_64__)
  if (wanted && std::strcmp(wanted, "baseline") == 0) return baseline_kernels();
  const bool avx2_only = wanted && std::strcmp(wanted, "avx2") == 0;
  if (avx512_supported() && !avx2_only) return avx512_kernels();
  if (avx2_supported()) return avx2_kernels();
  return baseline_kernels();
#else
  return plain_kernels();
#endif
}

}  // namespace

#if defined(__x86_64__)
bool avx2_supported() {
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
         __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("fma");
}

bool avx512_supported() {
  return avx2_supported() && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
         __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512vnni");
}
#endif

const Kernels& kernels() {
  static const Kernels& chosen = choose();
  return chosen;
}

}  // namespace polyhull::silhouette
