// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the packets of a stream are: the caps that their numbers of formats stand for.
///
/// A take has them twice, in the table `format` and, on pages of its own, in the index that copies it,
/// so that a damaged page costs no packet.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "take/database.h"

namespace polyhull {

class TakeFormats {
 public:
  /// Longer caps, and brackets deeper in each other, are no writer's: they are passed over.
  static constexpr std::size_t longest_caps = 64 << 10;
  static constexpr int deepest_brackets = 16;

  /// Those of \p stream, as far as they can be read. \p database outlives it.
  TakeFormats(TakeDatabase& database, std::int64_t stream);

  /// What \p format stands for: nothing where both places are damaged, two texts where they differ.
  std::vector<std::string_view> find(std::int64_t format);

 private:
  using Texts = std::map<std::int64_t, std::string>;
  void load();
  void load(const char* sql, Texts& texts);

  TakeDatabase& database_;
  std::int64_t stream_;
  Texts of_table_, of_index_;
};

}  // namespace polyhull
