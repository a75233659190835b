// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Numbers side by side in a register, for loops that are compiled once per instruction set
/// (base/instruction_set.h): all of it is each file's own, and nothing is included whose inline functions
/// could leave that.
#pragma once

namespace polyhull {
namespace {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = int __attribute__((vector_size(16)));
using Long2 = long long __attribute__((vector_size(16)));
using Double4 = double __attribute__((vector_size(32)));
using Long4 = long long __attribute__((vector_size(32)));
using Float8 = float __attribute__((vector_size(32)));
using Int8 = int __attribute__((vector_size(32)));

template <class Vector, class Scalar>
inline Vector load(const Scalar* from) {
  Vector out;
  __builtin_memcpy(&out, from, sizeof out);
  return out;
}
template <class Vector, class Scalar>
inline void store(Scalar* to, const Vector& values) {
  __builtin_memcpy(to, &values, sizeof values);
}

inline Float8 all(float value) {
  return Float8{value, value, value, value, value, value, value, value};
}
inline float smaller(float a, float b) {
  return a < b ? a : b;
}
inline float larger(float a, float b) {
  return a > b ? a : b;
}
inline Float8 smaller(const Float8& a, const Float8& b) {
  return a < b ? a : b;
}
inline Float8 larger(const Float8& a, const Float8& b) {
  return a > b ? a : b;
}

/// Whether a comparison holds anywhere.
inline bool any(const Int8& flags) {
  const auto four = load<Long4>(&flags);
#if defined(__AVX__)
  return __builtin_ia32_ptestz256(four, four) == 0;
#else
  return ((four[0] | four[1]) | (four[2] | four[3])) != 0;
#endif
}

}  // namespace
}  // namespace polyhull
