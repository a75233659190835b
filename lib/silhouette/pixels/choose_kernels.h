// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which set of inner loops runs. Apart from kernels.h, which is compiled once per instruction set
/// and must not bring the standard library's inline functions along.
#pragma once

#include <string>

#include "silhouette/pixels/kernels.h"

namespace polyhull::silhouette {

struct KernelChoice {
  const Kernels& kernels;
  std::string complaint;  ///< for people; empty: it is what was asked for
};

/// The set that \p wanted names (plain, baseline, avx2 or avx512); the best of this machine where it is
/// null or empty, and with a complaint where there is no such set, or not on this machine.
KernelChoice choose_kernels(const char* wanted);

}  // namespace polyhull::silhouette
