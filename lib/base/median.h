// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What is typical of some numbers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace polyhull {

/// The middle one of \p values by size (of an even number the upper of both), 0 of none.
template <class Number>
Number median(std::vector<Number> values) {
  if (values.empty()) return Number(0);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace polyhull
