// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Inner loops that are compiled once per instruction set from one text. A set of them is a struct of
/// function pointers, LOOPS, in NAME.h; NAME.inc ends with LOOPS::LOOPS_ISA(), and a line of its folder's
/// meson.build has it compiled as LOOPS::baseline() and, for x86-64, as LOOPS::avx2().
#pragma once

namespace polyhull {

/// Whether this machine has what -march=x86-64-v3 asks for, as far as such loops use it.
bool has_avx2();
/// The same for -march=x86-64-v4 with -mavx512vnni.
bool has_avx512();

/// Whether it has AVX2 and the environment's POLYHULL_ISA does not say baseline or plain. What else it may be,
/// and what is said about other values: silhouette/pixels/kernels.cpp.
bool may_use_avx2();

/// The best of a set of loops that may be used here.
template <class Loops>
const Loops& best_loops() {
#if defined(__x86_64__)
  static const Loops& chosen = may_use_avx2() ? Loops::avx2() : Loops::baseline();
  return chosen;
#else
  return Loops::baseline();
#endif
}

}  // namespace polyhull
