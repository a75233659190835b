// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/file_names.h"

#include <fmt/format.h>

namespace polyhull {
namespace {

bool plain(unsigned char c) {
  return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '-' ||
         c == '_' || c == '.' || c >= 0x80;
}

// 16 for what is no digit.
int digit(char c) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  const std::size_t found = digits.find(c);
  return found == digits.npos ? 16 : static_cast<int>(found);
}

}  // namespace

std::string file_name_of(std::string_view name) {
  std::string result;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (plain(byte) && !(c == '.' && result.empty()))
      result += c;
    else
      result += fmt::format("%{:02X}", byte);
  }
  return result;
}

std::string name_of_file(std::string_view stem) {
  std::string name;
  for (std::size_t i = 0; i < stem.size(); ++i) {
    if (stem[i] != '%') {
      name += stem[i];
      continue;
    }
    if (i + 2 >= stem.size()) return std::string(stem);
    const int high = digit(stem[i + 1]), low = digit(stem[i + 2]);
    if (high > 15 || low > 15) return std::string(stem);
    name += static_cast<char>(16 * high + low);
    i += 2;
  }
  return file_name_of(name) == stem ? name : std::string(stem);
}

}  // namespace polyhull
