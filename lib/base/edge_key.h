// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// One number for the edge between two vertices, whichever way it runs.
#pragma once

#include <algorithm>
#include <cstdint>

namespace polyhull {

/// The lower of the two vertices in the upper 32 bits, the higher one in the lower.
inline std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return static_cast<std::uint64_t>(std::min(a, b)) << 32 | std::max(a, b);
}

}  // namespace polyhull
