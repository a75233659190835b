// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Options of a command line that take one of several words.
#pragma once

#include <CLI/CLI.hpp>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace polyhull {

/// Adds \p option, which sets \p value to what its word stands for.
template <typename Enum>
CLI::Option* add_choice(CLI::App& app, const std::string& option, Enum& value,
                        const std::string& description,
                        std::initializer_list<std::pair<const char*, Enum>> words) {
  // As numbers, for CLI11 would print enums of one byte as characters.
  std::vector<std::pair<std::string, int>> numbers;
  for (const auto& [word, meaning] : words) numbers.emplace_back(word, static_cast<int>(meaning));
  const std::string names = CLI::detail::generate_map(numbers, true);
  return app.add_option(option, value, description)
      ->transform(CLI::CheckedTransformer(numbers).description(names));
}

}  // namespace polyhull
