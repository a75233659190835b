// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How long something took.
#pragma once

#include <chrono>
#include <utility>

namespace polyhull {

/// Runs from its making on.
class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }
  double milliseconds() const { return 1e3 * seconds(); }

  /// The seconds so far, and begins again.
  double lap() {
    const Clock::time_point now = Clock::now();
    const std::chrono::duration<double> taken = now - std::exchange(begin_, now);
    return taken.count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point begin_ = Clock::now();
};

}  // namespace polyhull
