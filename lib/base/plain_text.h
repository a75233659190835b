// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Texts that people's programs wrote, on whatever system.
#pragma once

#include <string>
#include <string_view>

namespace polyhull {

/// \p bytes as UTF-8 without a byte order mark, each line ended by \\n alone. Windows' \\r\\n and the
/// old Macintosh's \\r become \\n, UTF-16 (with its mark, or with a zero as the first or second byte,
/// as ASCII has it) is decoded. Throws Error (bad_input), beginning with \p source, for UTF-32 and
/// for UTF-16 that is broken. All that reads a text file reads it by this.
std::string plain_text(std::string bytes, const std::string& source);

/// \p text with small letters in place of ASCII's capitals.
std::string lower_case(std::string_view text);

}  // namespace polyhull
