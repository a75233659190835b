// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/pieces/handles.h"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <span>
#include <vector>

namespace polyhull::refine {
namespace {

/// A node's neighbourhood: bit 13 + dx + 3 dy + 9 dz; its own is bit 13.
using Around = std::uint32_t;
constexpr int own = 13;

struct AroundTables {
  Around sides = 0, edges = 0;    ///< the six neighbours, and the eighteen
  std::array<Around, 27> next{};  ///< which of the eighteen are side by side with each

  AroundTables() {
    const auto square = [](int a, int b) {
      const int x = a % 3 - b % 3, y = a / 3 % 3 - b / 3 % 3, z = a / 9 - b / 9;
      return x * x + y * y + z * z;
    };
    for (int a = 0; a < 27; ++a) {
      if (square(a, own) == 1) sides |= 1u << a;
      if (square(a, own) == 1 || square(a, own) == 2) edges |= 1u << a;
      for (int b = 0; b < 27; ++b)
        if (square(a, b) == 1 && b != own) next[a] |= 1u << b;
    }
  }
};

/// The part of \p among that hangs together with the bit \p from by \p next.
Around flood(int from, Around among, const std::array<Around, 27>& next) {
  Around found = 1u << from, front = found;
  while (front != 0) {
    const int bit = std::countr_zero(front);
    front &= front - 1;
    const Around more = next[bit] & among & ~found;
    found |= more;
    front |= more;
  }
  return found;
}

/// Puts the thin nodes of a level back.
class Regrowth {
 public:
  Regrowth(Level& level, const LevelRuns& runs, float hair,
           const std::function<bool(const Vec3f&)>& needed)
      : level_(level), grid_(level.grid), needed_(needed) {
    const LevelRuns core = find_runs(level, hair);
    parent_.resize(core.components);
    std::iota(parent_.begin(), parent_.end(), 0u);
    first_.push_back(0);
    for (std::size_t r = 0; r < level.rows.size(); ++r) {
      const std::span<const Run> deep = core.row(r);
      std::size_t next = 0;
      for (const Run& run : runs.row(r))
        for (int x = run.begin; x < run.end;) {
          while (next < deep.size() && deep[next].end <= x) ++next;
          if (next < deep.size() && deep[next].begin <= x) {
            pieces_.push_back(deep[next]);
            x = deep[next].end;
          } else {
            thin_.push_back({static_cast<std::uint32_t>(pieces_.size()), r});
            pieces_.push_back({x, x + 1, absent});
            ++x;
          }
        }
      first_.push_back(static_cast<std::uint32_t>(pieces_.size()));
    }
    unneeded_.resize(pieces_.size());
  }

  /// Returns how many nodes stay out, and puts them outside of the surface.
  std::size_t run() {
    std::vector<Thin> order = thin_;
    std::stable_sort(order.begin(), order.end(),
                     [&](const Thin& a, const Thin& b) { return value(a) > value(b); });
    for (const Thin& node : order) put_back(node);
    std::size_t count = 0;
    for (const Thin& node : thin_) {
      if (pieces_[node.piece].component != waiting) continue;
      value(node) = -value(node);
      ++count;
    }
    return count;
  }

 private:
  static constexpr std::uint32_t absent = 0xffffffff, waiting = 0xfffffffe;
  /// A node that is less than a hair deep: a piece of its own.
  struct Thin {
    std::uint32_t piece = 0;
    std::size_t row = 0;
  };

  float& value(const Thin& node) {
    return level_
        .values[node.row * grid_.row() + static_cast<std::size_t>(pieces_[node.piece].begin)];
  }
  Vec3f position(const Thin& node) const {
    const int y = static_cast<int>(node.row) % grid_.ny, z = static_cast<int>(node.row) / grid_.ny;
    return grid_.position(pieces_[node.piece].begin, y, z);
  }
  std::uint32_t root(std::uint32_t label) {
    while (parent_[label] != label) label = parent_[label] = parent_[parent_[label]];
    return label;
  }
  /// Calls body(bit, number of the piece, row) for each neighbour of \p node in a piece. Nodes at the
  /// grid's border are outside.
  template <typename Body>
  void each_neighbour(const Thin& node, const Body& body) const {
    const int x = pieces_[node.piece].begin;
    for (int k = 0; k < 9; ++k) {
      const std::size_t row = node.row + static_cast<std::size_t>(k / 3) * grid_.ny + k % 3 -
                              static_cast<std::size_t>(grid_.ny) - 1;
      const auto begin = pieces_.begin() + first_[row], end = pieces_.begin() + first_[row + 1];
      auto piece = std::partition_point(begin, end, [&](const Run& run) { return run.end < x; });
      for (; piece != end && piece->begin <= x + 1; ++piece) {
        const auto p = static_cast<std::uint32_t>(piece - pieces_.begin());
        for (int dx = std::max(-1, piece->begin - x); dx <= std::min(1, piece->end - 1 - x); ++dx)
          if (3 * k + dx + 1 != own) body(3 * k + dx + 1, p, row);
      }
    }
  }
  bool is_needed(const Thin& node) {
    if (unneeded_[node.piece]) return false;
    unneeded_[node.piece] = !needed_(position(node));
    return !unneeded_[node.piece];
  }
  /// Whether \p node may go back, and went.
  bool try_node(const Thin& node) {
    static const AroundTables tables;
    Around inside = 0;
    std::uint32_t label[27] = {};
    each_neighbour(node, [&](int bit, std::uint32_t piece, std::size_t) {
      label[bit] = pieces_[piece].component;
      if (label[bit] < waiting) inside |= 1u << bit;
    });
    std::uint32_t joined[6];
    int count = 0;
    for (Around left = inside & tables.sides; left != 0;) {
      const int bit = std::countr_zero(left);
      left &= ~flood(bit, inside & tables.edges, tables.next);
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
    pieces_[node.piece].component = joined[0];
    return true;
  }
  /// Of \p node, and of those that waited for it.
  void put_back(const Thin& node) {
    todo_.assign(1, node);
    while (!todo_.empty()) {
      const Thin next = todo_.back();
      todo_.pop_back();
      if (pieces_[next.piece].component < waiting) continue;
      if (!try_node(next)) {
        pieces_[next.piece].component = waiting;
        continue;
      }
      each_neighbour(next, [&](int, std::uint32_t piece, std::size_t row) {
        if (pieces_[piece].component == waiting) todo_.push_back({piece, row});
      });
    }
  }

  Level& level_;
  const Grid& grid_;
  const std::function<bool(const Vec3f&)>& needed_;
  std::vector<Run> pieces_;  ///< runs of the core, and thin nodes: of the forest, or none yet
  std::vector<std::uint32_t> first_;   ///< of each row's pieces, and one past the last
  std::vector<std::uint32_t> parent_;  ///< the forest of what hangs together
  std::vector<Thin> thin_, todo_;
  std::vector<bool> unneeded_;  ///< of each piece: asked, since a node is tried again and again
};

}  // namespace

std::size_t cut_thin_handles(Level& level, const LevelRuns& runs, float hair,
                             const std::function<bool(const Vec3f& node)>& needed) {
  return Regrowth(level, runs, hair, needed).run();
}

}  // namespace polyhull::refine
