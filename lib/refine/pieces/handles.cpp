// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/pieces/handles.h"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <span>
#include <vector>

#include "refine/field/cell_surface.h"
#include "refine/field/fine_field.h"

namespace polyhull::refine {
namespace {

/// A node's neighbourhood: bit 13 + dx + 3 dy + 9 dz; its own is bit 13.
using Around = std::uint32_t;
constexpr int own = 13;
/// Of f, in what is filled.
constexpr float least_fill = 0.02f;
/// By how much the middle of a hole may be farther outside the hull than the node beside it, cells.
constexpr float between_nodes = 0.25f;

/// How nodes of a kind hang together: over faces of cells those inside, over edges and corners, too, those
/// outside.
struct Adjacency {
  Around beside = 0;              ///< the neighbours that a node hangs together with
  Around within = 0;              ///< by way of which these may hang together around it
  std::array<Around, 27> next{};  ///< which of the neighbours hang together with each

  /// Neighbours are up to \p square apart, squared, and meet around a node within \p around.
  Adjacency(int square, int around) {
    const auto apart = [](int a, int b) {
      const int x = a % 3 - b % 3, y = a / 3 % 3 - b / 3 % 3, z = a / 9 - b / 9;
      return x * x + y * y + z * z;
    };
    for (int a = 0; a < 27; ++a) {
      if (a == own) continue;
      if (apart(a, own) <= square) beside |= 1u << a;
      if (apart(a, own) <= around) within |= 1u << a;
      for (int b = 0; b < 27; ++b)
        if (a != b && b != own && apart(a, b) <= square) next[a] |= 1u << b;
    }
  }
  static const Adjacency& of_inside() {
    static const Adjacency six(1, 2);
    return six;
  }
  static const Adjacency& of_outside() {
    static const Adjacency all(3, 3);
    return all;
  }
};

/// The part of \p among that hangs together with the bit \p from by \p next, or at least what it has of
/// \p wanted.
Around flood(int from, Around among, Around wanted, const std::array<Around, 27>& next) {
  Around found = 1u << from, front = found;
  while (front != 0 && (wanted & ~found) != 0) {
    const int bit = std::countr_zero(front);
    front &= front - 1;
    const Around more = next[bit] & among & ~found;
    found |= more;
    front |= more;
  }
  return found;
}

/// Of nodes that hang together with none: one that would close a loop, one that was not tried yet, one
/// of the other side, and one that is not said to be anything. Lower labels are of the forest.
constexpr std::uint32_t refused = 0xfffffffc, absent = 0xfffffffd, other_side = 0xfffffffe,
                        unsaid = 0xffffffff;
/// Of the outside's parts, the one that is no hollow (Run::before).
constexpr std::uint32_t around_all = 0;

/// Labels of a grid's nodes, all unsaid before and after.
class Labels {
 public:
  Labels(std::vector<std::uint32_t>& labels, const Grid& grid) : labels_(labels) {
    labels_.resize(std::max(labels_.size(), grid.size()), unsaid);
  }
  ~Labels() {
    for (const auto& [first, count] : said_) fill(first, count, unsaid);
  }
  Labels(const Labels&) = delete;
  Labels& operator=(const Labels&) = delete;

  void say(std::size_t first, int count, std::uint32_t label) {
    said_.emplace_back(first, count);
    fill(first, count, label);
  }
  std::uint32_t& operator[](std::size_t node) { return labels_[node]; }

 private:
  void fill(std::size_t first, int count, std::uint32_t label) {
    std::fill_n(labels_.begin() + static_cast<std::ptrdiff_t>(first), count, label);
  }
  std::vector<std::uint32_t>& labels_;
  std::vector<std::pair<std::size_t, int>> said_;
};

/// Calls body(the first node of row r, its runs) for each row.
template <typename Body>
void each_row(const LevelRuns& runs, const Grid& grid, const Body& body) {
  for (std::size_t r = 0; r + 1 < runs.first.size(); ++r) body(r * grid.row(), runs.row(r));
}

/// Puts nodes back to what they were taken from, all but those that would close a loop of it.
class Regrowth {
 public:
  /// Of \p labels those that are no constants are below \p components. What is unsaid is of the other
  /// side, but where \p outside, f, is not above 0: \p around_all.
  Regrowth(const Grid& grid, const Adjacency& adjacency, Labels& labels, std::uint32_t components,
           const float* outside, const std::function<bool(const Vec3f&)>& needed)
      : grid_(grid),
        adjacency_(adjacency),
        labels_(labels),
        outside_(outside),
        needed_(needed),
        parent_(components) {
    std::iota(parent_.begin(), parent_.end(), 0u);
    for (int k = 0; k < 27; ++k)
      step_[k] = (k / 9 - 1) * static_cast<std::ptrdiff_t>(grid_.slab()) +
                 (k / 3 % 3 - 1) * static_cast<std::ptrdiff_t>(grid_.row()) + k % 3 - 1;
  }

  /// Of \p node, and of those that were refused beside it.
  void put_back(std::size_t node) {
    todo_.assign(1, node);
    while (!todo_.empty()) {
      const std::size_t next = todo_.back();
      todo_.pop_back();
      if (is_back(next)) continue;
      if (!try_node(next)) continue;
      for (int bit = 0; bit < 27; ++bit)
        if (labels_[beside(next, bit)] == refused) todo_.push_back(beside(next, bit));
    }
  }
  bool is_back(std::size_t node) { return labels_[node] < refused; }

 private:
  std::size_t beside(std::size_t node, int bit) const {
    return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(node) + step_[bit]);
  }
  std::uint32_t root(std::uint32_t label) {
    while (parent_[label] != label) label = parent_[label] = parent_[parent_[label]];
    return label;
  }
  std::uint32_t label_of(std::size_t node) {
    const std::uint32_t label = labels_[node];
    if (label != unsaid) return label;
    return outside_ != nullptr && !(outside_[node] > 0.0f) ? around_all : other_side;
  }
  /// Asked once, since a node is tried again and again.
  bool is_needed(std::size_t node) {
    if (labels_[node] == refused) return false;
    const std::size_t row = node / grid_.row();
    const bool needed =
        needed_(grid_.position(static_cast<int>(node % grid_.row()),
                               static_cast<int>(row) % grid_.ny, static_cast<int>(row) / grid_.ny));
    if (!needed) labels_[node] = refused;
    return needed;
  }
  /// Whether \p node, which is at no border of the grid, may go back, and went.
  bool try_node(std::size_t node) {
    Around same = 0;
    std::uint32_t label[27];
    for (int bit = 0; bit < 27; ++bit) {
      label[bit] = label_of(beside(node, bit));
      same |= static_cast<Around>(label[bit] < refused) << bit;
    }
    std::uint32_t joined[27];  // at most eight; the compiler does not know
    int count = 0;
    for (Around left = same & adjacency_.beside; left != 0;) {
      const int bit = std::countr_zero(left);
      left &= ~flood(bit, same & adjacency_.within, left, adjacency_.next);
      joined[count++] = root(label[bit]);
    }
    std::sort(joined, joined + count);
    if (std::adjacent_find(joined, joined + count) != joined + count && !is_needed(node))
      return false;
    if (count == 0) {
      joined[count++] = static_cast<std::uint32_t>(parent_.size());
      parent_.push_back(joined[0]);
    }
    for (int i = 1; i < count; ++i) parent_[joined[i]] = joined[0];
    labels_[node] = joined[0];
    return true;
  }

  const Grid& grid_;
  const Adjacency& adjacency_;
  Labels& labels_;
  const float* outside_;
  const std::function<bool(const Vec3f&)>& needed_;
  std::ptrdiff_t step_[27];            ///< to the neighbours, by bit
  std::vector<std::uint32_t> parent_;  ///< the forest of what hangs together
  std::vector<std::size_t> todo_;
};

/// A node that is taken out, and f there.
struct Taken {
  std::size_t node = 0;
  float value = 0.0f;
};

/// Puts \p taken back, those first of which \p sign times f is the largest.
void put_back(Regrowth& regrowth, std::vector<Taken>& taken, float sign) {
  std::stable_sort(taken.begin(), taken.end(),
                   [&](const Taken& a, const Taken& b) { return sign * a.value > sign * b.value; });
  for (const Taken& one : taken) regrowth.put_back(one.node);
}

/// Of nodes that are inside, those \p by further along x than the nodes of a word of \p row.
std::uint64_t shifted(const std::uint64_t* row, std::size_t word, std::size_t words, int by) {
  if (by == 0) return row[word];
  if (by > 0) return row[word] >> by | (word + 1 < words ? row[word + 1] << (64 - by) : 0);
  return row[word] << -by | (word > 0 ? row[word - 1] >> (64 + by) : 0);
}

/// Which nodes of a word of row (y, z), two rows or more from the grid's border, are between two walls:
/// along an axis or a diagonal there are nodes \p inside one or two steps to either side.
std::uint64_t between_walls(const Signs& inside, const Grid& grid, int y, int z, std::size_t word) {
  const auto wall = [&](int dx, int dy, int dz) {
    return shifted(inside.row(grid, y + dy, z + dz), word, inside.words, dx) |
           shifted(inside.row(grid, y + 2 * dy, z + 2 * dz), word, inside.words, 2 * dx);
  };
  std::uint64_t between = 0;
  for (int bit = own + 1; bit < 27; ++bit) {
    const int dx = bit % 3 - 1, dy = bit / 3 % 3 - 1, dz = bit / 9 - 1;
    between |= wall(dx, dy, dz) & wall(-dx, -dy, -dz);
  }
  return between;
}

/// H at \p node, where f is \p value, or where Level::hull does not say it what it is at least.
float hull_at(const Level& level, std::size_t node, float value) {
  return level.hull[node] < hull_far ? level.hull[node] : value + hull_near;
}

/// Fills all nodes outside that are between walls, less than \p depth deep there and at most \p beyond
/// outside the hull: as deep inside as they were outside, where the hull allows.
std::vector<Taken> fill_all(Level& level, float depth, float beyond) {
  std::vector<Taken> taken;
  const Grid& grid = level.grid;
  Signs inside, near;
  inside.find(level, 0.0f, 1);
  near.find(level, -depth, 1);
  const auto take = [&](std::size_t node) {
    const float value = level.values[node];
    if (hull_at(level, node, value) >= std::min(between_nodes - beyond, 0.0f))
      taken.push_back({node, value});
  };
  for (int z = 2; z + 2 < grid.nz; ++z)
    for (int y = 2; y + 2 < grid.ny; ++y)
      for (std::size_t w = 0; w < inside.words; ++w) {
        std::uint64_t bits = near.row(grid, y, z)[w] & ~inside.row(grid, y, z)[w];
        if (bits != 0) bits &= between_walls(inside, grid, y, z, w);
        for (; bits != 0; bits &= bits - 1)
          take(grid.node(static_cast<int>(64 * w) + std::countr_zero(bits), y, z));
      }
  for (const Taken& one : taken)
    level.values[one.node] =
        std::max(std::min(-one.value, hull_at(level, one.node, one.value)), least_fill);
  return taken;
}

}  // namespace

std::size_t cut_thin_handles(Level& level, const LevelRuns& runs, float hair,
                             const std::function<bool(const Vec3f& node)>& needed,
                             std::vector<std::uint32_t>& labels) {
  Labels of_nodes(labels, level.grid);
  std::vector<Taken> thin;
  each_row(runs, level.grid, [&](std::size_t row, std::span<const Run> some) {
    for (const Run& run : some) {
      of_nodes.say(row + static_cast<std::size_t>(run.begin), run.end - run.begin, absent);
      for (std::size_t i = row + static_cast<std::size_t>(run.begin);
           i < row + static_cast<std::size_t>(run.end); ++i)
        if (level.values[i] <= hair) thin.push_back({i, level.values[i]});
    }
  });
  const LevelRuns core = find_runs(level, hair);
  each_row(core, level.grid, [&](std::size_t row, std::span<const Run> some) {
    for (const Run& run : some)
      of_nodes.say(row + static_cast<std::size_t>(run.begin), run.end - run.begin, run.component);
  });
  Regrowth regrowth(level.grid, Adjacency::of_inside(), of_nodes, core.components, nullptr, needed);
  put_back(regrowth, thin, 1.0f);
  std::size_t count = 0;
  for (const Taken& one : thin) {
    if (regrowth.is_back(one.node)) continue;
    level.values[one.node] = -one.value;
    ++count;
  }
  return count;
}

std::size_t fill_narrow_tunnels(Level& level, float depth, float beyond,
                                std::vector<std::uint32_t>& labels) {
  const std::function<bool(const Vec3f&)> never = [](const Vec3f&) { return false; };
  std::vector<Taken> narrow = fill_all(level, depth, beyond);
  const LevelRuns full = find_runs(level, 0.0f);
  Labels of_nodes(labels, level.grid);
  each_row(full, level.grid, [&](std::size_t row, std::span<const Run> some) {
    for (std::size_t i = 1; i < some.size(); ++i)
      if (some[i].before != around_all)
        of_nodes.say(row + static_cast<std::size_t>(some[i - 1].end),
                     some[i].begin - some[i - 1].end, some[i].before);
  });
  for (const Taken& one : narrow) of_nodes.say(one.node, 1, absent);
  Regrowth regrowth(level.grid, Adjacency::of_outside(), of_nodes, full.hollows + 1,
                    level.values.data(), never);
  put_back(regrowth, narrow, -1.0f);
  std::size_t count = 0;
  for (const Taken& one : narrow) {
    if (regrowth.is_back(one.node))
      level.values[one.node] = one.value;
    else
      ++count;
  }
  return count;
}

}  // namespace polyhull::refine
