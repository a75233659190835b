// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The middle of some numbers.
#pragma once

#include <algorithm>
#include <vector>

namespace polyhull::calibration {

/// The upper median; 0 of none.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace polyhull::calibration
