// SPDX-License-Identifier: LGPL-2.1-or-later
#include "base/parse_json.h"

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "base/error.h"

namespace polyhull {
namespace {

// Where the byte-th byte of text (from 1) is: "line 3, column 7".
std::string line_and_column(std::string_view text, std::size_t byte) {
  std::size_t line = 1, column = 1;
  for (std::size_t i = 0; i + 1 < byte && i < text.size(); ++i) {
    if (text[i] == '\n') {
      ++line;
      column = 1;
    } else {
      ++column;
    }
  }
  return fmt::format("line {}, column {}", line, column);
}

}  // namespace

std::size_t json_depth(std::string_view text) {
  std::size_t depth = 0, most = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '"') in_string = !in_string;
    if (in_string) {
      i += c == '\\';
    } else if (c == '[' || c == '{') {
      most = std::max(most, ++depth);
    } else if ((c == ']' || c == '}') && depth > 0) {
      --depth;
    }
  }
  return most;
}

template <class Json>
Json parse_json(std::string_view text, const std::string& source) {
  if (json_depth(text) > deepest_json)
    throw Error(Error::Kind::bad_input, "{}: more than {} brackets within each other.", source,
                deepest_json);
  try {
    return Json::parse(text);
  } catch (const nlohmann::detail::parse_error& error) {
    // nlohmann: "[json.exception.parse_error.101] parse error at line 1, column 2: what"
    const char* begin = std::strstr(error.what(), ": ");
    std::string what = begin ? begin + 2 : error.what();
    // What was read last may be a picture's worth of base64.
    constexpr std::size_t longest = 80;
    if (const std::size_t last = what.find("; last read: '");
        what.size() - std::min(last, what.size()) > longest)
      what.resize(last);
    throw Error(Error::Kind::bad_input, "{}: not JSON at {}: {}{}.", source,
                line_and_column(text, error.byte), what,
                text.find("NaN") != text.npos ? " (NaN is no JSON number)" : "");
  } catch (const nlohmann::detail::exception& error) {
    throw Error(Error::Kind::bad_input, "{}: not usable JSON: {}.", source, error.what());
  }
}

template nlohmann::json parse_json(std::string_view, const std::string&);
template nlohmann::ordered_json parse_json(std::string_view, const std::string&);

}  // namespace polyhull
