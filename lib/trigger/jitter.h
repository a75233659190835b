// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How evenly pulses come.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace polyhull {

/// Mean and spread of how late pulses begin (Welford's method).
class Jitter {
 public:
  /// \p lateness in ns; the results are in microseconds.
  void add(std::int64_t lateness) {
    const double x = lateness * 1e-3;
    recent_[static_cast<std::size_t>(count_) % recent_.size()] = std::abs(x);
    ++count_;
    const double step = x - mean_;
    mean_ += step / count_;
    squares_ += step * (x - mean_);
    largest_ = std::max(largest_, std::abs(x));
  }
  /// Mean, standard deviation and largest magnitude so far, microseconds.
  double mean() const { return mean_; }
  double deviation() const { return count_ > 1 ? std::sqrt(squares_ / (count_ - 1)) : 0.0; }
  double largest() const { return largest_; }
  /// The magnitude, microseconds, that 99 of 100 of the last 1000 do not exceed; 0 of none.
  double p99() const {
    auto sorted = recent_;
    const std::size_t count = std::min(static_cast<std::size_t>(count_), sorted.size());
    if (count == 0) return 0.0;
    const auto rank = sorted.begin() + static_cast<std::ptrdiff_t>((99 * count + 99) / 100 - 1);
    std::nth_element(sorted.begin(), rank, sorted.begin() + static_cast<std::ptrdiff_t>(count));
    return *rank;
  }

 private:
  double count_ = 0.0, mean_ = 0.0, squares_ = 0.0, largest_ = 0.0;  // microseconds
  std::array<double, 1000> recent_{};                                // magnitudes, a ring
};

}  // namespace polyhull
