// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A number for what bytes hold: to tell contents apart that come by accident, not by intent.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace polyhull {

/// FNV-1a (Fowler, Noll, Vo) over words of eight bytes; the order of add() counts.
class ContentHash {
 public:
  void add_bytes(const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (; size > 0;) {
      std::uint64_t word = 0;
      const std::size_t count = size < 8 ? size : 8;
      std::memcpy(&word, bytes, count);
      value_ = (value_ ^ word) * 1099511628211ull;
      bytes += count;
      size -= count;
    }
  }
  /// A number, or a struct of numbers without gaps.
  template <class T>
  void add(const T& value) {
    add_bytes(&value, sizeof value);
  }
  /// How many, and each.
  template <class T>
  void add(const std::vector<T>& values) {
    add(values.size());
    add_bytes(values.data(), values.size() * sizeof(T));
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 1469598103934665603ull;
};

}  // namespace polyhull
