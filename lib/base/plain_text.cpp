// SPDX-License-Identifier: LGPL-2.1-or-later
#include "base/plain_text.h"

#include <cctype>
#include <cstdint>

#include "base/error.h"

namespace polyhull {
namespace {

void append_utf8(std::string& out, std::uint32_t code) {
  const auto add = [&](std::uint32_t byte) { out += static_cast<char>(byte); };
  const auto tail = [&](int shift) { add(0x80 | (code >> shift & 0x3F)); };
  if (code < 0x80) return add(code);
  if (code < 0x800) {
    add(0xC0 | code >> 6);
  } else {
    if (code < 0x10000) {
      add(0xE0 | code >> 12);
    } else {
      add(0xF0 | code >> 18);
      tail(12);
    }
    tail(6);
  }
  tail(0);
}

std::string from_utf16(std::string_view bytes, bool big_endian, const std::string& source) {
  const auto broken = [&] {
    return Error(Error::Kind::bad_input,
                 "{}: its text is UTF-16 and broken (cut short or not text); save it as UTF-8.",
                 source);
  };
  if (bytes.size() % 2 != 0) throw broken();
  const auto unit = [&](std::size_t i) -> std::uint32_t {
    const auto first = static_cast<unsigned char>(bytes[i]);
    const auto second = static_cast<unsigned char>(bytes[i + 1]);
    return big_endian ? first << 8 | second : second << 8 | first;
  };
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 2) {
    std::uint32_t code = unit(i);
    if (code >= 0xD800 && code < 0xE000) {  // a pair for one character
      if (code >= 0xDC00 || i + 2 >= bytes.size()) throw broken();
      i += 2;
      const std::uint32_t low = unit(i);
      if (low < 0xDC00 || low >= 0xE000) throw broken();
      code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
    }
    append_utf8(out, code);
  }
  return out;
}

}  // namespace

std::string plain_text(std::string bytes, const std::string& source) {
  using namespace std::string_view_literals;
  std::string_view view = bytes;
  if (view.starts_with("\xFF\xFE\0\0"sv) || view.starts_with("\0\0\xFE\xFF"sv))
    throw Error(Error::Kind::bad_input, "{}: its text is UTF-32; save it as UTF-8.", source);
  if (view.starts_with("\xFF\xFE"sv))
    bytes = from_utf16(view.substr(2), false, source);
  else if (view.starts_with("\xFE\xFF"sv))
    bytes = from_utf16(view.substr(2), true, source);
  else if (view.size() >= 2 && (view[0] == 0) != (view[1] == 0))
    bytes = from_utf16(view, view[0] == 0, source);
  else if (view.starts_with("\xEF\xBB\xBF"sv))
    bytes.erase(0, 3);
  std::size_t end = 0;
  for (std::size_t i = 0; i < bytes.size();) {
    if (bytes[i] != '\r') {
      bytes[end++] = bytes[i++];
      continue;
    }
    std::size_t next = i;
    while (next < bytes.size() && bytes[next] == '\r') ++next;
    // A file that was turned to Windows' line ends twice has two \r before its \n.
    const bool windows = next < bytes.size() && bytes[next] == '\n';
    for (std::size_t lines = windows ? 1 : next - i; lines > 0; --lines) bytes[end++] = '\n';
    i = next + windows;
  }
  bytes.resize(end);
  return bytes;
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

}  // namespace polyhull
