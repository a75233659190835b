// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// JSON from a file or from the network. Not for public headers: it needs nlohmann's.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace polyhull {

/// Arrays and objects within each other, beyond which JSON's functions, which call themselves as
/// deep, may run out of stack.
constexpr std::size_t deepest_json = 64;

/// How many arrays and objects stand within each other in \p text at most.
std::size_t json_depth(std::string_view text);

/// The value that \p text is, as nlohmann::json or nlohmann::ordered_json. Throws Error (bad_input),
/// beginning with \p source, for what is not JSON (line and column), and for more than
/// `deepest_json` arrays and objects within each other. Compiled once, for nlohmann's parser takes
/// seconds to compile.
template <class Json = nlohmann::json>
Json parse_json(std::string_view text, const std::string& source);

}  // namespace polyhull
