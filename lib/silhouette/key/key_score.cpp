// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/key/key_score.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace polyhull {
namespace {

constexpr int cell = 8;                 // px
constexpr int black = 5, white = 250;   // alpha up to, from which on
constexpr double least_subject = 0.01;  // of the region

struct Cell {
  bool has_black = false, has_white = false;
  int subject = 0, screen = 0;  // pixels in between, by the half level
};

}  // namespace

double KeyScore::score() const {
  const double doubtful = doubtful_subject + doubtful_screen;
  return std::clamp(100.0 * (1.0 - doubtful / std::max(subject, least_subject)), 0.0, 100.0);
}

KeyScore score_of(const Matte& matte, const Rectangle& region) {
  KeyScore score;
  if (region.empty()) return score;
  const int across = (region.width + cell - 1) / cell, down = (region.height + cell - 1) / cell;
  std::vector<Cell> cells(static_cast<std::size_t>(across) * static_cast<std::size_t>(down));
  const auto at = [&](int i, int j) -> Cell& {
    return cells[static_cast<std::size_t>(j) * static_cast<std::size_t>(across) +
                 static_cast<std::size_t>(i)];
  };
  std::uint64_t subject = 0;
  for (int y = 0; y < region.height; ++y) {
    const std::uint8_t* row = matte.row(region.y + y) + region.x;
    for (int x = 0; x < region.width; ++x) {
      Cell& in = at(x / cell, y / cell);
      const int alpha = row[x];
      subject += alpha >= 128;
      in.has_black |= alpha <= black;
      in.has_white |= alpha >= white;
      if (alpha > black && alpha < white) ++(alpha >= 128 ? in.subject : in.screen);
    }
  }
  std::uint64_t in_subject = 0, in_screen = 0;
  for (int j = 0; j < down; ++j)
    for (int i = 0; i < across; ++i) {
      const Cell& in = at(i, j);
      if (in.subject + in.screen == 0) continue;
      bool has_black = false, has_white = false;
      for (int v = std::max(j - 1, 0); v <= std::min(j + 1, down - 1); ++v)
        for (int u = std::max(i - 1, 0); u <= std::min(i + 1, across - 1); ++u) {
          has_black |= at(u, v).has_black;
          has_white |= at(u, v).has_white;
        }
      if (has_black && has_white) continue;
      in_subject += static_cast<std::uint64_t>(in.subject);
      in_screen += static_cast<std::uint64_t>(in.screen);
    }
  const double pixels = static_cast<double>(region.width) * region.height;
  score.subject = static_cast<double>(subject) / pixels;
  score.doubtful_subject = static_cast<double>(in_subject) / pixels;
  score.doubtful_screen = static_cast<double>(in_screen) / pixels;
  return score;
}

}  // namespace polyhull
