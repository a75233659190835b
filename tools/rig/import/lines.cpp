// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/import/lines.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <set>

#include "rig/file_names.h"

namespace polyhull::import {
namespace {

constexpr std::string_view blanks = " \t\v\f";

std::vector<std::string_view> split(std::string_view text, std::string_view separators) {
  std::vector<std::string_view> words;
  for (std::size_t at = 0; (at = text.find_first_not_of(separators, at)) != text.npos;) {
    const std::size_t end = std::min(text.find_first_of(separators, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

std::string_view without_comment(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i)
    if ((i == 0 || blanks.find(text[i - 1]) != blanks.npos) &&
        (text[i] == '#' || text[i] == '%' || text.substr(i).starts_with("//")))
      return text.substr(0, i);
  return text;
}

bool commas_are_decimal(std::string_view text) {
  if (text.find('.') != text.npos) return false;
  for (const std::string_view word : split(text, " \t\v\f;")) {
    const std::size_t comma = word.find(',');
    if (comma == word.npos) continue;
    if (comma == 0 || comma + 1 == word.size() || !is_digit(word[comma - 1]) ||
        !is_digit(word[comma + 1]) || word.find(',', comma + 1) != word.npos)
      return false;
  }
  return true;
}

// \p text with an ASCII blank and minus where pages and spreadsheets have typographic ones, and with
// points for the decimal commas of numbers in quotation marks.
std::string plain_characters(std::string text) {
  for (const auto& [from, to] : {std::pair{"\xC2\xA0", " "}, {"\xE2\x88\x92", "-"}})
    for (std::size_t at = 0; (at = text.find(from, at)) != text.npos; ++at)
      text.replace(at, std::string_view(from).size(), to);
  for (std::size_t open = text.find('"'); open != text.npos;) {
    const std::size_t close = text.find('"', open + 1);
    if (close == text.npos) break;
    std::string cell = text.substr(open + 1, close - open - 1);
    if (std::ranges::count(cell, ',') == 1) {
      std::ranges::replace(cell, ',', '.');
      if (number_of(cell)) text.replace(open + 1, cell.size(), cell);
    }
    open = text.find('"', close + 1);
  }
  return text;
}

bool all_differ(const std::vector<std::string>& names) {
  return std::set<std::string>(names.begin(), names.end()).size() == names.size();
}

}  // namespace

std::vector<Line> lines_of(std::string_view text) {
  std::vector<Line> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string_view line = text.substr(at, end - at);
    line.remove_prefix(std::min(line.find_first_not_of(blanks), line.size()));
    line = line.substr(0, line.find_last_not_of(blanks) + 1);
    lines.push_back({lines.size() + 1, line});
    at = end + 1;
  }
  return lines;
}

std::vector<std::string_view> words_of(std::string_view text) {
  return split(text, blanks);
}

std::optional<double> number_of(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  std::string with_e;
  if (const std::size_t exponent = word.find_first_of("dD");
      exponent != word.npos && word.find_first_not_of("+-.0123456789dD") == word.npos) {
    with_e = word;
    with_e[exponent] = 'e';
    word = with_e;
  }
  double value = NAN;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty() || end != word.data() + word.size()) return std::nullopt;
  if (error == std::errc()) return value;
  const std::size_t exponent = word.find_first_of("eE");  // of a number too large or too small
  return exponent != word.npos && word[exponent + 1] == '-' ? 0.0 : HUGE_VAL;
}

std::vector<Row> rows_of(std::string_view text) {
  std::vector<Row> rows;
  for (const Line& line : lines_of(text)) {
    const std::string plain = plain_characters(std::string(line.text));
    const std::string_view content = without_comment(plain);
    const bool decimal = commas_are_decimal(content);
    Row row{line.number, {}};
    for (const std::string_view word : split(content, decimal ? " \t\v\f;\"" : " \t\v\f;,\"")) {
      row.words.emplace_back(word);
      std::ranges::replace(row.words.back(), ',', '.');
    }
    if (!row.words.empty()) rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<std::string> distinct_names(const std::vector<std::string>& paths) {
  std::vector<std::string> stems;
  std::vector<std::filesystem::path> above;
  for (std::string path : paths) {
    std::ranges::replace(path, '\\', '/');
    const std::filesystem::path plain = std::filesystem::path(path).lexically_normal();
    stems.push_back(name_of_file(plain.stem().string()));
    above.push_back(plain.parent_path());
  }
  // Of each level of folders, from the pictures on, with \p behind.
  const auto named = [&](auto behind) -> std::optional<std::vector<std::string>> {
    auto at = above;
    while (std::ranges::all_of(at, [](const auto& path) { return path.has_filename(); })) {
      std::vector<std::string> names;
      for (std::size_t i = 0; i < at.size(); ++i)
        names.push_back(name_of_file(at[i].filename().string()) + behind(i));
      if (all_differ(names)) return names;
      for (std::filesystem::path& path : at) path = path.parent_path();
    }
    return std::nullopt;
  };
  if (paths.size() > 1)
    if (auto folders = named([](std::size_t) { return ""; })) return *folders;
  if (all_differ(stems)) return stems;
  return named([&](std::size_t i) { return "/" + stems[i]; }).value_or(stems);
}

}  // namespace polyhull::import
