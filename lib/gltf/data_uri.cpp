// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gltf/data_uri.h"

#include <algorithm>
#include <cctype>

#include "base/error.h"
#include "base/plain_text.h"

namespace polyhull {
namespace {

constexpr std::size_t longest_name = 100;

/// The six bits that \p c stands for; -1: none.
int base64_bits(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  if (c == '+' || c == '-') return 62;
  if (c == '/' || c == '_') return 63;
  return -1;
}

std::vector<unsigned char> decode_base64(std::string_view text, const std::string& source) {
  std::vector<unsigned char> bytes;
  bytes.reserve(text.size() / 4 * 3);
  unsigned bits = 0;
  std::size_t digits = 0;
  bool ended = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (std::isspace(static_cast<unsigned char>(text[i]))) continue;
    const int digit = base64_bits(text[i]);
    ended = ended || text[i] == '=';
    if (ended ? text[i] != '=' : digit < 0) {
      throw Error(Error::Kind::bad_input,
                  "{}: its base64 text is damaged: character {} does not belong there.", source,
                  i + 1);
    }
    if (ended) continue;
    bits = bits << 6 | static_cast<unsigned>(digit);
    if (++digits % 4 != 1)
      bytes.push_back(static_cast<unsigned char>(bits >> (8 - 2 * (digits % 4)) % 8));
  }
  if (digits % 4 == 1)
    throw Error(Error::Kind::bad_input, "{}: its base64 text is cut short.", source);
  return bytes;
}

}  // namespace

bool is_data_uri(std::string_view uri) {
  return lower_case(uri.substr(0, 5)) == "data:";
}

std::vector<unsigned char> decode_data_uri(std::string_view uri, const std::string& source) {
  const std::size_t comma = uri.find(',');
  if (comma == uri.npos) {
    throw Error(Error::Kind::bad_input,
                "{}: its address begins with \"data:\" but has no comma before the data.", source);
  }
  std::string type = lower_case(uri.substr(0, comma));
  std::erase_if(type, [](unsigned char c) { return std::isspace(c); });
  const std::string data = unescape(uri.substr(comma + 1));
  if ((type + ";").find(";base64;") != type.npos) return decode_base64(data, source);
  return {data.begin(), data.end()};
}

std::string address_name(std::string_view uri) {
  // The data of an address that is not told from a file's name are none either.
  std::size_t length = std::min({uri.size(), longest_name, uri.find(";base64,")});
  if (length == uri.size()) return std::string(uri);
  // Not within a character of UTF-8.
  while (length > 0 && (static_cast<unsigned char>(uri[length]) & 0xC0) == 0x80) --length;
  return std::string(uri.substr(0, length)) + "...";
}

std::string unescape(std::string_view text) {
  if (text.find('%') == text.npos) return std::string(text);
  const auto digit = [&](std::size_t i) {
    if (i >= text.size() || !std::isxdigit(static_cast<unsigned char>(text[i]))) return -1;
    return std::isdigit(static_cast<unsigned char>(text[i])) ? text[i] - '0'
                                                             : (text[i] | 32) - 'a' + 10;
  };
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const int high = digit(i + 1), low = digit(i + 2);
    if (text[i] == '%' && high >= 0 && low >= 0) {
      result += static_cast<char>(16 * high + low);
      i += 2;
    } else {
      result += text[i];
    }
  }
  return result;
}

}  // namespace polyhull
