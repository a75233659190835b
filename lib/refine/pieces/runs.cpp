// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/pieces/runs.h"

#include <algorithm>
#include <bit>
#include <numeric>

namespace polyhull::refine {
namespace {

/// The first of \p count bits from \p x on that is \p set.
int next_bit(const std::vector<std::uint64_t>& words, int x, int count, bool set) {
  while (x < count) {
    const std::uint64_t word = words[x / 64], rest = (set ? word : ~word) >> x % 64;
    if (rest != 0) return std::min(count, x + std::countr_zero(rest));
    x = (x / 64 + 1) * 64;
  }
  return count;
}

/// Calls meet(number in a, number in b, where both are) for runs that have nodes side by side.
template <typename Meet>
void meet_runs(std::span<const Run> a, std::span<const Run> b, const Meet& meet) {
  for (std::size_t i = 0, k = 0; i < a.size() && k < b.size();) {
    const Run both{std::max(a[i].begin, b[k].begin), std::min(a[i].end, b[k].end)};
    if (both.begin < both.end) meet(i, k, both);
    ++(a[i].end < b[k].end ? i : k);
  }
}

/// Numbers components, and counts handles by Euler's formula: a run is a point, as far as topology
/// goes, runs that meet an edge, and what is common to the four rows of a square fills one.
void join(LevelRuns& level, const Grid& grid) {
  std::vector<std::uint32_t> root(level.runs.size());
  std::iota(root.begin(), root.end(), 0u);
  const auto find = [&](std::uint32_t run) {
    while (root[run] != run) run = root[run] = root[root[run]];
    return run;
  };
  auto euler = static_cast<std::int64_t>(level.runs.size());
  std::vector<Run> below,
      above;  // common to a row and its neighbour along z, for y before and here
  const auto join_rows = [&](std::size_t r, std::size_t other, std::vector<Run>* common) {
    meet_runs(level.row(r), level.row(other), [&](std::size_t i, std::size_t k, const Run& both) {
      const std::uint32_t p = find(level.first[r] + static_cast<std::uint32_t>(i)),
                          q = find(level.first[other] + static_cast<std::uint32_t>(k));
      root[std::max(p, q)] = std::min(p, q);
      --euler;
      if (common) common->push_back(both);
    });
  };
  const auto ny = static_cast<std::size_t>(grid.ny);
  for (std::size_t r = 0; r + 1 < level.first.size(); ++r) {
    above.clear();
    if (r >= ny) join_rows(r, r - ny, &above);
    if (r % ny > 0) {
      join_rows(r, r - 1, nullptr);
      meet_runs(below, above, [&](std::size_t, std::size_t, const Run&) { ++euler; });
    }
    std::swap(below, above);
  }
  for (std::uint32_t i = 0; i < level.runs.size();
       ++i)  // roots come before the runs that they have
    level.runs[i].component = root[i] == i ? level.components++ : level.runs[find(i)].component;
  level.handles = level.components - euler;
}

}  // namespace

LevelRuns find_runs(const Level& level, float above) {
  LevelRuns out;
  std::vector<float> row;
  std::vector<std::uint64_t> words;
  out.first.push_back(0);
  for (std::size_t r = 0; r < level.rows.size(); ++r) {
    const Extent extent = level.rows[r];
    const int begin = extent.begin / 8 * 8;
    const int nodes = extent.begin == extent.end ? 0 : (extent.end - begin + 7) / 8 * 8;
    const float* values = level.values.data() + r * level.grid.row() + begin;
    row.resize(static_cast<std::size_t>(nodes));
    float* __restrict over = row.data();
    for (int x = 0; x < nodes; ++x) over[x] = values[x] - above;
    words.assign(static_cast<std::size_t>(nodes + 63) / 64, 0);
    loops().signs(over, nodes, words.data());
    for (int x = next_bit(words, 0, nodes, true); x < nodes;) {
      const int end = next_bit(words, x, nodes, false);
      out.runs.push_back({begin + x, begin + end});
      x = next_bit(words, end, nodes, true);
    }
    out.first.push_back(static_cast<std::uint32_t>(out.runs.size()));
  }
  join(out, level.grid);
  return out;
}

}  // namespace polyhull::refine
