// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How evenly pulses come.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace polyhull {

/// Mean and spread of how late pulses begin (Welford's method).
class Jitter {
 public:
  /// \p lateness in ns; the results are in microseconds.
  void add(std::int64_t lateness) {
    const double x = lateness * 1e-3;
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

 private:
  double count_ = 0.0, mean_ = 0.0, squares_ = 0.0, largest_ = 0.0;  // microseconds
};

}  // namespace polyhull
