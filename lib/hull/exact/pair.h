// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Two doubles worked on at once: an extension of GCC and Clang for every machine. No operation is
/// fused or reordered, so results are the bytes that plain doubles give.
#pragma once

#include <cstdint>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace polyhull::hull {

typedef double Pair __attribute__((vector_size(16)));
typedef long long PairMask __attribute__((vector_size(16)));  ///< of comparisons: 0 or -1 each

/// Bit 0 and bit 1: the mask's elements. (Combine these bits rather than masks, which GCC does
/// badly.)
inline unsigned bits(PairMask mask) {
#ifdef __SSE2__
  return static_cast<unsigned>(_mm_movemask_pd(reinterpret_cast<Pair>(mask)));
#else
  return static_cast<unsigned>((mask[0] & 1) | (mask[1] & 2));
#endif
}
inline bool any(PairMask mask) {
  return bits(mask) != 0;
}
inline bool both(PairMask mask) {
  return bits(mask) == 3;
}

inline Pair least(Pair a, Pair b) {
#ifdef __SSE2__
  return _mm_min_pd(a, b);
#else
  return a < b ? a : b;
#endif
}
inline Pair most(Pair a, Pair b) {
#ifdef __SSE2__
  return _mm_max_pd(a, b);
#else
  return a > b ? a : b;
#endif
}
inline Pair absolute(Pair a) {
  return reinterpret_cast<Pair>(reinterpret_cast<PairMask>(a) & PairMask{INT64_MAX, INT64_MAX});
}

inline Pair firsts(Pair a, Pair b) {
  return Pair{a[0], b[0]};
}
inline Pair seconds(Pair a, Pair b) {
  return Pair{a[1], b[1]};
}
inline Pair swapped(Pair a) {
  return Pair{a[1], a[0]};
}

}  // namespace polyhull::hull
