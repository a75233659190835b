// SPDX-License-Identifier: LGPL-2.1-or-later
#include "take/formats.h"

#include <algorithm>

#include "base/error.h"

namespace polyhull {
namespace {

// Who reads caps calls itself for each bracket within another.
bool is_flat(std::string_view caps) {
  int depth = 0;
  return std::all_of(caps.begin(), caps.end(), [&](char c) {
    if (std::string_view("[{(<").find(c) != std::string_view::npos) ++depth;
    if (std::string_view("]})>").find(c) != std::string_view::npos) --depth;
    return depth <= TakeFormats::deepest_brackets;
  });
}

}  // namespace

TakeFormats::TakeFormats(TakeDatabase& database, std::int64_t stream)
    : database_(database), stream_(stream) {
  load();
}

void TakeFormats::load() {
  load("SELECT id, caps FROM format NOT INDEXED WHERE stream = ?", of_table_);
  load("SELECT id, caps FROM format INDEXED BY format_by_caps WHERE stream = ?", of_index_);
}

void TakeFormats::load(const char* sql, Texts& texts) {
  try {
    TakeStatement all(database_, sql);
    all.bind(stream_);
    while (all.step()) {
      std::string caps;
      if (all.bytes(1).size() <= longest_caps) caps = all.text(1);
      if (is_flat(caps)) texts.insert_or_assign(all.number(0), std::move(caps));
    }
  } catch (const Error&) {
    // Damaged, and those that came before are whole; or an older take, which has no such index.
  }
}

std::vector<std::string_view> TakeFormats::find(std::int64_t format) {
  std::vector<std::string_view> found;
  const auto look = [&] {
    for (const Texts* texts : {&of_table_, &of_index_})
      if (const auto at = texts->find(format); at != texts->end())
        if (found.empty() || found.front() != at->second) found.push_back(at->second);
  };
  look();
  if (found.empty()) {  // it has been written since
    load();
    look();
  }
  return found;
}

}  // namespace polyhull
