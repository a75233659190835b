// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which instruction set the loops that are compiled for several may use.
#pragma once

namespace polyhull {

/// Whether this machine has what -march=x86-64-v3 asks for, as far as such loops use it, and the
/// environment's POLYHULL_ISA does not say baseline or plain. What else it may be, and what is said
/// about other values: silhouette/pixels/kernels.cpp.
bool may_use_avx2();

}  // namespace polyhull
