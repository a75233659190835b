// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Lines of a lens file as cells, names and numbers (lens_table.h).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace polyhull::lens_file {

/// \p text without blanks at its ends.
std::string_view trimmed(std::string_view text);

/// \p cell for a message: short, and without what is no ASCII.
std::string shown(std::string_view cell);

/// "Focal length (mm)" as focal_length_mm.
std::string normalised_name(std::string_view cell);

/// What stands between the cells of \p heading: a semicolon, a comma, a tab, or a blank for any blanks.
char separator_of(std::string_view heading);

/// The cells of \p line, without quotes, between which a separator does not count. Empty cells at its
/// end, which spreadsheets leave, are none.
std::vector<std::string_view> cells_of(std::string_view line, char separator);

/// \p cell as a number: decimals behind a point or a comma; hexadecimal behind 0x; inf is one, nan is
/// none.
std::optional<double> number_of(std::string_view cell);

}  // namespace polyhull::lens_file
