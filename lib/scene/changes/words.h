// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The words of entries that people write, with semicolons between.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace polyhull {

struct Word {
  std::string text;     ///< without quotation marks
  bool quoted = false;  ///< it had them
};

/// Takes the blanks from the begin of \p rest.
void skip_blanks(std::string_view& rest);

/// The next word of \p rest, which is left behind it; none at the entry's end. Throws Error (bad_input) where
/// a quotation mark is missing.
std::optional<Word> next_word(std::string_view& rest);

}  // namespace polyhull
