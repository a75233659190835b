// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Faults of rigs and rig files.
#pragma once

#include <string>

#include "base/error.h"

namespace polyhull {

/// Throws Error (bad_input): \p what is wrong with \p where.
[[noreturn]] inline void fail_rig(const std::string& where, const std::string& what) {
  throw Error(Error::Kind::bad_input, "{}: {}.", where, what);
}

}  // namespace polyhull
