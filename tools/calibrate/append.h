// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Text that grows.
#pragma once

#include <fmt/format.h>

#include <iterator>
#include <string>
#include <utility>

namespace polyhull::calibrate_tool {

/// Appends \p values to \p out as fmt's \p format has them.
template <typename... Values>
void append(std::string& out, fmt::format_string<Values...> format, Values&&... values) {
  fmt::format_to(std::back_inserter(out), format, std::forward<Values>(values)...);
}

}  // namespace polyhull::calibrate_tool
