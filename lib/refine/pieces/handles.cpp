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
           const std::function<bool(const Vec3f&)>& needed, std::vector<std::uint32_t>& labels)
      : level_(level), grid_(level.grid), runs_(runs), needed_(needed), labels_(labels) {
    labels_.resize(std::max(labels_.size(), grid_.size()), outside_label);
    each_run(runs, [&](std::size_t first, const Run& run) {
      for (std::size_t i = first, end = first + length(run); i < end; ++i)
        if (level.values[i] <= hair) labels_[i] = absent, thin_.push_back(i);
    });
    const LevelRuns core = find_runs(level, hair);
    each_run(core, [&](std::size_t first, const Run& run) {
      std::fill_n(labels_.begin() + static_cast<std::ptrdiff_t>(first), length(run), run.component);
    });
    parent_.resize(core.components);
    std::iota(parent_.begin(), parent_.end(), 0u);
    for (int k = 0; k < 27; ++k)
      step_[k] = (k / 9 - 1) * static_cast<std::ptrdiff_t>(grid_.slab()) +
                 (k / 3 % 3 - 1) * static_cast<std::ptrdiff_t>(grid_.row()) + k % 3 - 1;
  }
  ~Regrowth() {
    each_run(runs_, [&](std::size_t first, const Run& run) {
      std::fill_n(labels_.begin() + static_cast<std::ptrdiff_t>(first), length(run), outside_label);
    });
  }
  Regrowth(const Regrowth&) = delete;
  Regrowth& operator=(const Regrowth&) = delete;

  /// Returns how many nodes stay out, and puts them outside of the surface.
  std::size_t run() {
    std::vector<std::size_t> order = thin_;
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return level_.values[a] > level_.values[b];
    });
    for (const std::size_t node : order) put_back(node);
    std::size_t count = 0;
    for (const std::size_t node : thin_) {
      if (labels_[node] < waiting) continue;
      level_.values[node] = -level_.values[node];
      ++count;
    }
    return count;
  }

 private:
  /// Of nodes inside that are no part of the forest, tried or not, one that no ray needs, and of nodes
  /// outside; lower labels are of the forest.
  static constexpr std::uint32_t waiting = 0xfffffffc, unneeded = 0xfffffffd, absent = 0xfffffffe,
                                 outside_label = 0xffffffff;

  static std::size_t length(const Run& run) {
    return static_cast<std::size_t>(run.end - run.begin);
  }
  /// Calls body(first node, run) for each run of \p some.
  template <typename Body>
  void each_run(const LevelRuns& some, const Body& body) const {
    for (std::size_t r = 0; r + 1 < some.first.size(); ++r)
      for (const Run& run : some.row(r))
        body(r * grid_.row() + static_cast<std::size_t>(run.begin), run);
  }
  std::size_t beside(std::size_t node, int bit) const {
    return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(node) + step_[bit]);
  }
  std::uint32_t root(std::uint32_t label) {
    while (parent_[label] != label) label = parent_[label] = parent_[parent_[label]];
    return label;
  }
  /// Asked once, since a node is tried again and again.
  bool is_needed(std::size_t node) {
    if (labels_[node] == unneeded) return false;
    const std::size_t row = node / grid_.row();
    const bool needed =
        needed_(grid_.position(static_cast<int>(node % grid_.row()),
                               static_cast<int>(row) % grid_.ny, static_cast<int>(row) / grid_.ny));
    if (!needed) labels_[node] = unneeded;
    return needed;
  }
  /// Whether \p node, which is at no border of the grid, may go back, and went.
  bool try_node(std::size_t node) {
    static const AroundTables tables;
    Around inside = 0;
    std::uint32_t label[27];
    for (int bit = 0; bit < 27; ++bit) {
      label[bit] = labels_[beside(node, bit)];
      inside |= static_cast<Around>(label[bit] < waiting) << bit;
    }
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
    labels_[node] = joined[0];
    return true;
  }
  /// Of \p node, and of those that waited for it.
  void put_back(std::size_t node) {
    todo_.assign(1, node);
    while (!todo_.empty()) {
      const std::size_t next = todo_.back();
      todo_.pop_back();
      if (labels_[next] < waiting) continue;
      if (!try_node(next)) {
        if (labels_[next] == absent) labels_[next] = waiting;
        continue;
      }
      for (int bit = 0; bit < 27; ++bit) {
        const std::uint32_t label = labels_[beside(next, bit)];
        if (label == waiting || label == unneeded) todo_.push_back(beside(next, bit));
      }
    }
  }

  Level& level_;
  const Grid& grid_;
  const LevelRuns& runs_;
  const std::function<bool(const Vec3f&)>& needed_;
  std::vector<std::uint32_t>& labels_;  ///< of nodes: of the forest, or none
  std::ptrdiff_t step_[27];             ///< to the neighbours, by bit
  std::vector<std::uint32_t> parent_;   ///< the forest of what hangs together
  std::vector<std::size_t> thin_, todo_;
};

}  // namespace

std::size_t cut_thin_handles(Level& level, const LevelRuns& runs, float hair,
                             const std::function<bool(const Vec3f& node)>& needed,
                             std::vector<std::uint32_t>& labels) {
  return Regrowth(level, runs, hair, needed, labels).run();
}

}  // namespace polyhull::refine
