// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// JSON from a file or from the network. Not for public headers: it needs nlohmann's.
#pragma once

#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/error.h"

namespace polyhull {

/// Where the \p byte-th byte of \p text (from 1) is: "line 3, column 7".
inline std::string line_and_column(std::string_view text, std::size_t byte) {
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

/// The value that \p text is. Throws Error (bad_input), beginning with \p source, for what is not
/// JSON (line and column), and for more than 64 arrays and objects within each other: JSON's
/// functions call themselves that often, and a stack is not endless.
template <class Json = nlohmann::json>
Json parse_json(std::string_view text, const std::string& source) {
  constexpr int deepest = 64;
  const auto not_too_deep = [&](int depth, typename Json::parse_event_t, Json&) {
    if (depth > deepest)
      throw Error(Error::Kind::bad_input, "{}: more than {} brackets within each other.", source,
                  deepest);
    return true;
  };
  try {
    return Json::parse(text, not_too_deep);
  } catch (const nlohmann::detail::parse_error& error) {
    // nlohmann: "[json.exception.parse_error.101] parse error at line 1, column 2: what"
    const char* what = std::strstr(error.what(), ": ");
    throw Error(Error::Kind::bad_input, "{}: not JSON at {}: {}{}.", source,
                line_and_column(text, error.byte), what ? what + 2 : error.what(),
                text.find("NaN") != text.npos ? " (NaN is no JSON number)" : "");
  } catch (const nlohmann::detail::exception& error) {
    throw Error(Error::Kind::bad_input, "{}: not usable JSON: {}.", source, error.what());
  }
}

}  // namespace polyhull
