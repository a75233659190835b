// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The next row of a frame, asked from memory while the row before is worked on: the hardware's own
/// prefetching stops between two rows. A few lines at a time, between the steps of that work, since
/// a processor waits when it has asked for more lines than it can keep track of. Internal.
#pragma once

#include <cstddef>
#include <cstdint>

namespace polyhull::silhouette {

class RowAhead {
 public:
  /// The bytes [begin, end) are read next.
  void begin(const std::uint8_t* begin, const std::uint8_t* end) {
    at_ = begin;
    end_ = end;
  }
  void some() {
    if (end_ - at_ >= lines * line) {
#pragma GCC unroll 12
      for (int i = 0; i < lines; ++i) __builtin_prefetch(at_ + i * line);
      at_ += lines * line;
    } else {
      for (; at_ < end_; at_ += line) __builtin_prefetch(at_);
    }
  }
  void rest() {
    while (at_ < end_) some();
  }

 private:
  static constexpr std::ptrdiff_t line = 64, lines = 12;
  const std::uint8_t *at_ = nullptr, *end_ = nullptr;
};

/// Where there may be none.
inline void some_of(RowAhead* ahead) {
  if (ahead != nullptr) ahead->some();
}

}  // namespace polyhull::silhouette
