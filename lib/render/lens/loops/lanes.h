// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Pixels side by side in a register, for loops that are compiled once per instruction set: all of it is
/// each file's own.
#pragma once

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace polyhull::lens {
namespace {

// What a register holds; each pixel's sums are the same however many lie side by side.
#if defined(__AVX2__)
constexpr int lanes = 8;
#else
constexpr int lanes = 4;
#endif
using Lanes = float __attribute__((vector_size(4 * lanes)));

inline Lanes load(const float* from) {
  Lanes value;
  __builtin_memcpy(&value, from, sizeof value);
  return value;
}

inline void store(float* to, Lanes value) {
  __builtin_memcpy(to, &value, sizeof value);
}

// The compiler makes no one instruction of a choice.
#if defined(__AVX2__)
inline Lanes lesser(Lanes a, Lanes b) {
  return _mm256_min_ps(a, b);
}
inline Lanes greater(Lanes a, Lanes b) {
  return _mm256_max_ps(a, b);
}
#elif defined(__x86_64__)
inline Lanes lesser(Lanes a, Lanes b) {
  return _mm_min_ps(a, b);
}
inline Lanes greater(Lanes a, Lanes b) {
  return _mm_max_ps(a, b);
}
#else
inline Lanes lesser(Lanes a, Lanes b) {
  return a < b ? a : b;
}
inline Lanes greater(Lanes a, Lanes b) {
  return a > b ? a : b;
}
#endif
inline Lanes all(float value) {
  return Lanes{} + value;
}
inline Lanes within(Lanes value) {
  return lesser(greater(value, Lanes{}), all(1.0f));
}
inline Lanes absolute(Lanes value) {
  return greater(value, -value);
}

inline Lanes root(Lanes value) {
#if defined(__AVX2__)
  return _mm256_sqrt_ps(value);
#elif defined(__x86_64__)
  return _mm_sqrt_ps(value);
#else
  for (int i = 0; i < lanes; ++i) value[i] = __builtin_sqrtf(value[i]);
  return value;
#endif
}

/// Whole numbers, and what comparisons make: all bits set where they hold.
using Places = int __attribute__((vector_size(4 * lanes)));

inline bool any(Places mask) {
#if defined(__AVX2__)
  return _mm256_movemask_ps(reinterpret_cast<__m256>(mask)) != 0;
#elif defined(__x86_64__)
  return _mm_movemask_ps(reinterpret_cast<__m128>(mask)) != 0;
#else
  for (int i = 0; i < lanes; ++i)
    if (mask[i] != 0) return true;
  return false;
#endif
}

/// 0, 1, 2 ...
inline Places counted() {
  Places value{};
  for (int i = 0; i < lanes; ++i) value[i] = i;
  return value;
}

/// The values at \p at.
inline Lanes gather(const float* from, Places at) {
#if defined(__AVX2__)
  return _mm256_i32gather_ps(from, reinterpret_cast<__m256i>(at), 4);
#else
  Lanes value;
  for (int i = 0; i < lanes; ++i) value[i] = from[at[i]];
  return value;
#endif
}

}  // namespace
}  // namespace polyhull::lens
