// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/lens/lens_table_text.h"

#include <charconv>
#include <cmath>
#include <cstdint>

namespace polyhull::lens_file {
namespace {

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

/// Where the first \p separator of \p line is that no quotation marks enclose; npos: nowhere.
std::size_t find_separator(std::string_view line, char separator) {
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"') quoted = !quoted;
    if (!quoted && (line[i] == separator || (separator == ' ' && line[i] == '\t'))) return i;
  }
  return line.npos;
}

}  // namespace

std::string shown(std::string_view cell) {
  std::string text(cell.substr(0, 40));
  for (char& c : text)
    if (c < ' ' || c > '~') c = '?';
  return text;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string normalised_name(std::string_view cell) {
  std::string name;
  for (const char c : cell) {
    const char lower = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    const bool counts = (lower >= 'a' && lower <= 'z') || (lower >= '0' && lower <= '9');
    if (counts) name += lower;
    if (!counts && !name.empty() && name.back() != '_') name += '_';
  }
  if (!name.empty() && name.back() == '_') name.pop_back();
  return name;
}

char separator_of(std::string_view heading) {
  for (const char c : {';', ',', '\t'})
    if (find_separator(heading, c) != heading.npos) return c;
  return ' ';
}

std::vector<std::string_view> cells_of(std::string_view line, char separator) {
  std::vector<std::string_view> cells;
  while (!line.empty()) {
    const std::size_t end = find_separator(line, separator);
    std::string_view cell = trimmed(line.substr(0, end));
    if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"')
      cell = cell.substr(1, cell.size() - 2);
    if (separator != ' ' || !cell.empty()) cells.push_back(cell);
    line.remove_prefix(end == std::string_view::npos ? line.size() : end + 1);
  }
  while (!cells.empty() && cells.back().empty()) cells.pop_back();
  return cells;
}

std::optional<double> number_of(std::string_view cell) {
  std::string with_point;
  if (const std::size_t comma = cell.find(','); comma != cell.npos && cell.find('.') == cell.npos) {
    with_point = cell;
    with_point[comma] = '.';
    cell = with_point;
  }
  if (!cell.empty() && cell.front() == '+') cell.remove_prefix(1);
  double value = 0.0;
  const char* end = cell.data() + cell.size();
  if (cell.starts_with("0x") || cell.starts_with("0X")) {
    std::uint64_t whole = 0;
    const auto read = std::from_chars(cell.data() + 2, end, whole, 16);
    if (read.ec != std::errc() || read.ptr != end) return {};
    return static_cast<double>(whole);
  }
  // No locale's comma.
  const auto read = std::from_chars(cell.data(), end, value);
  if (read.ec != std::errc() || read.ptr != end || std::isnan(value)) return {};
  return value;
}

}  // namespace polyhull::lens_file
