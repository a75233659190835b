// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/changes/named_parts.h"

#include <algorithm>

#include "base/error.h"

namespace polyhull {

std::string missing_words(const std::string& scene, const char* kind, const std::string& missing,
                          const std::vector<std::string>& there, bool numbered) {
  constexpr std::size_t most_named = 20;
  std::string list;
  for (std::size_t i = 0; i < std::min(there.size(), most_named); ++i) {
    list += i == 0 ? "" : ", ";
    list += numbered ? fmt::format("{} '{}'", i + 1, there[i]) : fmt::format("'{}'", there[i]);
  }
  if (there.size() > most_named) list += fmt::format(" and {} more", there.size() - most_named);
  return fmt::format("The scene '{}' has no {} {}; it has {}.", scene, kind, missing,
                     list.empty() ? "none" : list);
}

void add_missing(std::string& missing, const std::string& name) {
  missing += fmt::format("{}'{}'", missing.empty() ? "" : ", ", name);
}

}  // namespace polyhull
