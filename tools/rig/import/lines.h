// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Lines, words and numbers of text formats, as people and spreadsheets write them.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace polyhull::import {

/// A line of a file, without blanks at its ends.
struct Line {
  std::size_t number;  ///< from 1
  std::string_view text;
};

/// All lines of \p text, empty ones, too.
std::vector<Line> lines_of(std::string_view text);

/// What stands between blanks in \p text.
std::vector<std::string_view> words_of(std::string_view text);

/// The decimal number that all of \p word is, its exponent by E or Fortran's D; also "nan" and
/// "inf". Nothing for other words. In all languages of the system the mark is a point.
std::optional<double> number_of(std::string_view word);

/// A line of a table, cut into words at blanks, semicolons and commas.
struct Row {
  std::size_t number;  ///< of its line, from 1
  std::vector<std::string> words;
};

/// The lines of \p text that hold words. A comment begins with #, % or // at the line's beginning
/// or behind a blank; quotation marks are left out. Commas are decimal, and become points, where
/// each stands between two digits, none of the words has two, and the line has no point; so are they in
/// numbers in quotation marks. Typographic minus signs and blanks count as such.
std::vector<Row> rows_of(std::string_view text);

/// Names for pictures or files at \p paths (with / or \\). Where each of several has a folder of its
/// own, as of a folder for each camera, that of the nearest level at which all differ; else their
/// stems (see file_names.h); where these repeat, FOLDER/STEM.
std::vector<std::string> distinct_names(const std::vector<std::string>& paths);

}  // namespace polyhull::import
