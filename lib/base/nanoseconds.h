// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Times are nanoseconds.
#pragma once

#include <cstdint>

namespace polyhull {

constexpr std::int64_t second = 1'000'000'000;

}  // namespace polyhull
