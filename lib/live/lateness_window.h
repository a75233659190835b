// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How late things come, as far as the last seconds tell: what a deadline is set by.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

namespace polyhull {

/// The largest of the values of the last \p span nanoseconds, kept in slots of a sixteenth of the
/// span, so that an old value is forgotten up to a sixteenth late and nothing is allocated.
class LatenessWindow {
 public:
  explicit LatenessWindow(std::int64_t span = 10'000'000'000) : width_(span / slots) {}

  /// Notes \p value (ns, may be negative) at the time \p now (ns, not before 0).
  void add(std::int64_t now, std::int64_t value);

  /// The largest value of the span before \p now (ns), none where there is none.
  std::optional<std::int64_t> largest(std::int64_t now) const { return top(now).largest; }

  /// The same without the slot that holds the largest: what is there once, such as a long first time,
  /// does not count. None where there is no second slot.
  std::optional<std::int64_t> usually_largest(std::int64_t now) const { return top(now).second; }

  void reset() { newest_.fill({}); }

 private:
  static constexpr int slots = 16;
  struct Slot {
    std::int64_t number = -1;  // of the stretch of time it holds, -1: none
    std::int64_t largest = 0;
  };
  /// Of the slots' largest values.
  struct Top {
    std::optional<std::int64_t> largest, second;
  };
  Top top(std::int64_t now) const;

  std::int64_t width_;
  std::array<Slot, slots> newest_{};
};

}  // namespace polyhull
