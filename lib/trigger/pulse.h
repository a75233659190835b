// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// One trigger pulse.
#pragma once

#include <cstdint>

namespace polyhull {

struct Pulse {
  std::uint64_t number = 0;
  std::int64_t time = 0;      ///< on the clock, ns: its start
  std::int64_t lateness = 0;  ///< start minus the planned time, ns; on demand: minus the demand
};

}  // namespace polyhull
