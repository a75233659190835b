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

/// Runs joined to sets, each of which is named by its first.
class Sets {
 public:
  explicit Sets(std::size_t count) : root_(count) { std::iota(root_.begin(), root_.end(), 0u); }
  std::uint32_t find(std::uint32_t i) {
    while (root_[i] != i) i = root_[i] = root_[root_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    root_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> root_;
};

/// Numbers the parts of the outside that do not reach the grid's border. Outside are in each row the
/// gaps before runs, and all beside them, which reaches the border.
void find_hollows(LevelRuns& level, const Grid& grid) {
  constexpr std::uint32_t border = 0;  // else a gap's number is that of the run behind it
  Sets sets(level.runs.size() + 1);
  const auto gap_before = [&](std::size_t r, std::size_t i) {
    const std::span<const Run> row = level.row(r);
    Run gap{-1, grid.nx + 1, border};
    if (i > 0) gap.begin = row[i - 1].end;
    if (i < row.size()) gap.end = row[i].begin;
    if (i > 0 && i < row.size()) gap.component = level.first[r] + static_cast<std::uint32_t>(i);
    return gap;
  };
  const auto join_rows = [&](std::size_t r, std::size_t other) {
    const std::size_t count = level.row(r).size(), others = level.row(other).size();
    if (count < 2 && others < 2) return;
    for (std::size_t i = 0, k = 0; i <= count && k <= others;) {
      const Run a = gap_before(r, i), b = gap_before(other, k);
      if (std::max(a.begin, b.begin) <= std::min(a.end, b.end)) sets.join(a.component, b.component);
      ++(a.end < b.end ? i : k);
    }
  };
  const auto ny = static_cast<std::size_t>(grid.ny), nz = static_cast<std::size_t>(grid.nz);
  const auto each_gap = [&](std::size_t r, const auto& body) {
    for (std::size_t i = 1; i < level.row(r).size(); ++i) body(gap_before(r, i).component);
  };
  for (std::size_t z = 0, r = 0; z < nz; ++z)
    for (std::size_t y = 0; y < ny; ++y, ++r) {
      if (y == 0 || z == 0 || y + 1 == ny || z + 1 == nz)
        each_gap(r, [&](std::uint32_t gap) { sets.join(gap, border); });
      if (y > 0) join_rows(r, r - 1);
      if (z > 0) join_rows(r, r - ny);
      if (z > 0 && y > 0) join_rows(r, r - ny - 1);
      if (z > 0 && y + 1 < ny) join_rows(r, r - ny + 1);
    }
  for (std::size_t r = 0; r < ny * nz; ++r)
    each_gap(r, [&](std::uint32_t gap) {
      const std::uint32_t first = sets.find(gap);
      level.runs[gap].before = first == gap ? ++level.hollows : level.runs[first].before;
    });
}

/// Numbers components, and counts handles by Euler's formula: a run is a point, as far as topology
/// goes, runs that meet an edge, and what is common to the four rows of a square fills one.
void join(LevelRuns& level, const Grid& grid) {
  Sets sets(level.runs.size());
  auto euler = static_cast<std::int64_t>(level.runs.size());
  std::vector<Run> below,
      above;  // common to a row and its neighbour along z, for y before and here
  const auto join_rows = [&](std::size_t r, std::size_t other, std::vector<Run>* common) {
    meet_runs(level.row(r), level.row(other), [&](std::size_t i, std::size_t k, const Run& both) {
      sets.join(level.first[r] + static_cast<std::uint32_t>(i),
                level.first[other] + static_cast<std::uint32_t>(k));
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
  for (std::uint32_t i = 0; i < level.runs.size(); ++i) {
    const std::uint32_t first = sets.find(i);
    level.runs[i].component = first == i ? level.components++ : level.runs[first].component;
  }
  find_hollows(level, grid);
  level.handles = std::int64_t{level.components} - euler + level.hollows;
}

}  // namespace

LevelRuns find_runs(const Level& level, float above) {
  LevelRuns out;
  std::vector<std::uint64_t> words;
  out.first.push_back(0);
  for (std::size_t r = 0; r < level.rows.size(); ++r) {
    const Extent extent = level.rows[r];
    const int begin = extent.begin / 8 * 8;
    const int nodes = extent.begin == extent.end ? 0 : (extent.end - begin + 7) / 8 * 8;
    words.assign(static_cast<std::size_t>(nodes + 63) / 64, 0);
    Loops::best().signs(level.values.data() + r * level.grid.row() + begin, above, nodes,
                        words.data());
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
