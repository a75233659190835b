// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/merge/brick_merger.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "refine/field/cell_table.h"
#include "refine/merge/node_set.h"

namespace polyhull::refine {
namespace {

constexpr int nodes = Brick::nodes;

using Triple = std::array<int, 3>;

/// A point, in one register; the fourth number is 0.
using Place = float __attribute__((vector_size(16)));

inline Place yzx(Place a) {
  return __builtin_shufflevector(a, a, 1, 2, 0, 3);
}

inline Vec3f vector_of(Place a) {
  return {a[0], a[1], a[2]};
}

Triple ints(const std::array<std::uint8_t, 3>& from) {
  return {from[0], from[1], from[2]};
}

CellRegion region_of(const Triple& low, const Triple& size) {
  CellRegion region;
  for (int axis = 0; axis < 3; ++axis) {
    region.low[axis] = static_cast<std::uint8_t>(low[axis]);
    region.size[axis] = static_cast<std::uint8_t>(size[axis]);
  }
  return region;
}

/// The bits of the cells of a box.
std::uint64_t cells_of(const Triple& low, const Triple& size) {
  constexpr std::uint64_t along[3][5] = {
      {0, 0x1, 0x3, 0, 0xf}, {0, 0x1, 0x11, 0, 0x1111}, {0, 0x1, 0x10001, 0, 0x1000100010001}};
  // Sums of disjoint bits: products.
  const std::uint64_t box = along[0][size[0]] * along[1][size[1]] * along[2][size[2]];
  return box << Brick::cell_index(low[0], low[1], low[2]);
}

template <typename Body>
void each_cell(std::uint64_t some, const Body& body) {
  for (; some != 0; some &= some - 1) {
    const int c = std::countr_zero(some);
    body(c & 3, c >> 2 & 3, c >> 4);
  }
}

/// Whether the surface on a rectangle of cells is one arc: crossed edges less steps, as it has no
/// rings. \p rows of its nodes, from bit \p first on.
bool one_arc(const std::uint8_t* rows, int first, int width, int height) {
  const unsigned mask = (1u << width) - 1;
  int crossed = 0, steps = 0;
  unsigned row = unsigned{rows[0]} >> first;
  for (int j = 0;; ++j) {
    crossed += std::popcount((row ^ row >> 1) & mask);
    if (j == height) break;
    const unsigned next = unsigned{rows[j + 1]} >> first;
    crossed += std::popcount((row ^ next) & (2 * mask + 1));
    const unsigned any = row | row >> 1 | next | next >> 1;
    const unsigned every = row & row >> 1 & next & next >> 1;
    const unsigned twice = (row ^ row >> 1) & (row ^ next) & ~(row ^ next >> 1);
    steps += std::popcount(any & ~every & mask) + std::popcount(twice & mask);
    row = next;
  }
  return steps > 0 && crossed - steps == 1;
}

/// By how much Brick::edge_index() of a cell's edge exceeds that of its first node's edge along x.
const std::array<std::uint16_t, 12>& edge_offsets() {
  static const std::array<std::uint16_t, 12> offsets = [] {
    std::array<std::uint16_t, 12> made{};
    for (std::uint8_t e = 0; e < 12; ++e) {
      const CellEdge& edge = cell_table().edge(e);
      made[e] = static_cast<std::uint16_t>(Brick::edge_index({edge.x, edge.y, edge.z, edge.axis}));
    }
    return made;
  }();
  return offsets;
}

}  // namespace

/// What a brick's cells are merged with.
struct BrickMerger::Work {
  static constexpr int cells = Brick::cells;

  /// A box while others are made of it.
  struct Made {
    CellRegion region;
    Moments surface;
    bool disc = true;                            ///< its surface is one disc
    bool alive = true;                           ///< not a part of another
    std::uint16_t outline = 0, outline_end = 0;  ///< of outlines, where it is known
  };
  /// Rows of nodes (a, b) for each axis: bit i: inside; the first along y of (x, z), then x of (y, z),
  /// then x of (z, y).
  using Rows = std::array<std::array<std::array<std::uint8_t, nodes>, nodes>, 3>;

  void find_crossings(const Level& fine);
  void find_nodes();
  void find_cells();
  void find_rows();
  void merge();
  float most_off(std::uint64_t some) const {
    return (brick->rims & some) != 0 ? flatness.at_rims : flatness.anywhere;
  }
  bool refused(const CellRegion& region) const {
    return std::find(brick->refused.begin(), brick->refused.end(), region) != brick->refused.end();
  }
  bool outline(const Triple& low, const Triple& size, int& steps);
  bool is_disc(const Triple& low, const Triple& size, int axis);
  bool try_cube(const Triple& low, int side);
  void add(const CellRegion& region, const Moments& sum, bool disc);
  int alive_at(const Triple& low, const Triple& size) const;
  bool disc_again(const Triple& low, const Triple& size, int axis, bool both) const;
  void try_pair(std::size_t b, int axis);
  void finish();

  const CellTable& table = cell_table();
  const std::array<std::uint16_t, 12>& offsets = edge_offsets();
  Brick* brick = nullptr;
  Flatness flatness;
  NodeSet inside = 0;
  std::array<Place, 375> points;    // on crossed edges, by edge_index()
  std::array<Moments, 64> surface;  // of the active cells
  std::uint64_t discs = 0;          // whose surface is one disc
  std::uint64_t covered = 0;        // cells with surface, and those of merged boxes
  Rows rows;
  std::vector<Made> made;
  std::array<std::uint8_t, 64> made_of{};  // of each active cell: the one it lies in
  std::array<std::uint16_t, 375> next{};   // around a box, of outline()
  std::vector<std::uint16_t> around;       // it
  std::vector<std::uint16_t> outlines;     // of cubes
};

void BrickMerger::Work::find_crossings(const Level& fine) {
  const Grid& grid = fine.grid;
  const auto& signs = brick->signs;
  const std::size_t step[3] = {1, grid.row(), grid.slab()};
  for (int k = 0; k < nodes; ++k)
    for (int j = 0; j < nodes; ++j) {
      const unsigned crossed[3] = {(signs[k][j] ^ signs[k][j] >> 1) & 0xfu,
                                   j < cells ? unsigned(signs[k][j] ^ signs[k][j + 1]) : 0u,
                                   k < cells ? unsigned(signs[k][j] ^ signs[k + 1][j]) : 0u};
      const std::size_t row =
          grid.node(cells * brick->x, cells * brick->y + j, cells * brick->z + k);
      for (int axis = 0; axis < 3; ++axis)
        for (unsigned bits = crossed[axis]; bits != 0; bits &= bits - 1) {
          const int i = std::countr_zero(bits);
          const float* value = fine.values.data() + row + i;
          const float at = crossing(value[0], value[step[axis]]);
          Place& point = points[Brick::edge_index({i, j, k, axis})];
          point = Place{static_cast<float>(i), static_cast<float>(j), static_cast<float>(k), 0.0f};
          point[axis] += at;
          if (i < cells && j < cells && k < cells)
            brick->along[Brick::own_edge({i, j, k, axis})] = at;
        }
    }
}

void BrickMerger::Work::find_nodes() {
  inside = 0;
  for (int k = nodes - 1; k >= 0; --k)
    for (int j = nodes - 1; j >= 0; --j) inside = inside << nodes | brick->signs[k][j];
}

void BrickMerger::Work::find_rows() {
  rows = {};
  for (int a = 0; a < nodes; ++a)
    for (int b = 0; b < nodes; ++b) {
      for (int i = 0; i < nodes; ++i) rows[0][a][b] |= unsigned(brick->inside(a, i, b)) << i;
      rows[1][a][b] = brick->signs[b][a], rows[2][a][b] = brick->signs[a][b];
    }
}

/// The surface in single cells: a third of a loop's mass is in its corners, as if it were a parallelogram, and
/// the rest in their middle.
void BrickMerger::Work::find_cells() {
  discs = 0;
  each_cell(brick->active, [&](int i, int j, int k) {
    const unsigned corners = brick->pattern(i, j, k);
    const int cell = Brick::cell_index(i, j, k);
    if (table.loops(corners) == 1) discs |= std::uint64_t{1} << cell;
    const std::span<const FaceStep> steps = table.steps(corners);
    const Place* const first = &points[Brick::edge_index({i, j, k, 0})];
    const auto point = [&](std::uint8_t edge) { return first[offsets[edge]]; };
    Place from = point(steps.front().from), sum{}, twice{}, square{}, mixed{};
    Place from_yzx = yzx(from);
    for (const FaceStep& step : steps) {
      if (&step != steps.data() && step.from != (&step)[-1].to)
        from = point(step.from), from_yzx = yzx(from);
      const Place to = point(step.to), to_yzx = yzx(to);
      twice += from_yzx * yzx(to_yzx) - to_yzx * yzx(from_yzx);  // a cross product
      sum += from, square += from * from, mixed += from * from_yzx;
      from = to, from_yzx = to_yzx;
    }
    Moments& own = surface[static_cast<std::size_t>(cell)];
    own.normal = 0.5f * vector_of(twice);
    own.area = glm::length(own.normal);
    const float count = static_cast<float>(steps.size()), share = own.area / (3.0f * count);
    const Place middle = sum / count;
    own.sum = own.area * vector_of(middle);
    square = share * (square + 2.0f * middle * sum);
    mixed = share * (mixed + 2.0f * yzx(middle) * sum);
    for (int axis = 0; axis < 3; ++axis)
      own.squares[axis] = square[axis], own.squares[3 + axis] = mixed[axis];
  });
}

/// The edges around a box whose cells' surfaces are discs each; false: it has several outlines. \p steps:
/// the steps on all faces of its cells, those between two cells once.
bool BrickMerger::Work::outline(const Triple& low, const Triple& size, int& steps) {
  int first = -1, inner = 0, outer = 0;
  each_cell(brick->active & cells_of(low, size), [&](int i, int j, int k) {
    unsigned faces = 0;
    const int at[3] = {i, j, k}, own = Brick::edge_index({i, j, k, 0});
    for (int axis = 0; axis < 3; ++axis)
      faces |= unsigned(at[axis] == low[axis]) << 2 * axis |
               unsigned(at[axis] == low[axis] + size[axis] - 1) << (2 * axis + 1);
    for (const FaceStep& step : table.steps(brick->pattern(i, j, k))) {
      if (!(faces >> step.face & 1)) {
        ++inner;
        continue;
      }
      first = own + offsets[step.from];
      next[first] = static_cast<std::uint16_t>(own + offsets[step.to]);
      ++outer;
    }
  });
  steps = outer + inner / 2;
  around.clear();
  int here = first;
  do {
    around.push_back(static_cast<std::uint16_t>(here));
    here = next[here];
  } while (here != first);
  return static_cast<int>(around.size()) == outer;
}

/// Whether the surface in a cube is one disc that crosses each edge of the cube once at most, and
/// some: there is one outline; no line of nodes along \p axis is crossed twice, so none of it is closed;
/// and Euler's characteristic is 1.
bool BrickMerger::Work::is_disc(const Triple& low, const Triple& size, int axis) {
  const std::uint64_t some = brick->active & cells_of(low, size);
  if ((some & ~discs) != 0) return false;
  unsigned whole[3], ends[3];
  for (int a = 0; a < 3; ++a) {
    whole[a] = ((2u << size[a]) - 1) << low[a];
    ends[a] = (1u | 1u << size[a]) << low[a];
  }
  const NodeSet corners = nodes_at(ends);
  if ((inside & corners) == 0 || (inside & corners) == corners) return false;
  int crossed_edges = 0;
  for (int a = 0; a < 3; ++a) {
    unsigned from[3] = {whole[0], whole[1], whole[2]};
    from[a] &= whole[a] >> 1;
    const NodeSet crossed = (inside ^ inside >> node_step[a]) & nodes_at(from);
    crossed_edges += count_of(crossed);
    NodeSet twice = 0;
    for (int k = 1; k < size[a]; ++k) {
      from[a] &= whole[a] >> (k + 1);
      twice |= crossed & crossed >> k * node_step[a] & nodes_at(from);
    }
    if (a != axis) {
      unsigned lines[3] = {ends[0], ends[1], ends[2]};
      lines[a] = whole[a];
      twice &= nodes_at(lines);
    }
    if (twice != 0) return false;
  }
  int steps = 0;
  return outline(low, size, steps) && crossed_edges - steps + std::popcount(some) == 1;
}

/// Makes a cube of cells one box where it may be.
bool BrickMerger::Work::try_cube(const Triple& low, int side) {
  const Triple size{side, side, side};
  const CellRegion region = region_of(low, size);
  const std::uint64_t all = cells_of(low, size), some = brick->active & all;
  Moments sum;
  each_cell(some, [&](int i, int j, int k) { sum.add(surface[Brick::cell_index(i, j, k)]); });
  if (!sum.is_flat(most_off(some)) || refused(region)) return false;
  const Vec3f turned = glm::abs(sum.normal);
  const int axis = turned.x > turned.y   ? (turned.x > turned.z ? 0 : 2)
                   : turned.y > turned.z ? 1
                                         : 2;
  if (!is_disc(low, size, axis)) return false;
  add(region, sum, true);
  made.back().outline = static_cast<std::uint16_t>(outlines.size());
  outlines.insert(outlines.end(), around.begin(), around.end());
  made.back().outline_end = static_cast<std::uint16_t>(outlines.size());
  return true;
}

void BrickMerger::Work::add(const CellRegion& region, const Moments& sum, bool disc) {
  const std::uint64_t all = cells_of(ints(region.low), ints(region.size));
  const auto number = static_cast<std::uint8_t>(made.size());
  covered |= all;
  each_cell(brick->active & all,
            [&](int i, int j, int k) { made_of[Brick::cell_index(i, j, k)] = number; });
  made.push_back({region, sum, disc});
}

/// The box that just fills a region; -1: it has no surface and is in no box, -2: neither.
int BrickMerger::Work::alive_at(const Triple& low, const Triple& size) const {
  const std::uint64_t all = cells_of(low, size), some = brick->active & all;
  if (some == 0) return (covered & all) == 0 ? -1 : -2;
  const int b = made_of[std::countr_zero(some)];
  return made[b].region == region_of(low, size) ? b : -2;
}

/// Whether two boxes side by side along \p axis make one whose surface is a disc that crosses each of its
/// edges once at most, and some. \p both: they both have surface.
bool BrickMerger::Work::disc_again(const Triple& low, const Triple& size, int axis,
                                   bool both) const {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  bool some = false, all = true;
  for (int e = 0; e < 4; ++e) {
    Triple p = low;
    p[u] += (e & 1) * size[u], p[v] += (e >> 1) * size[v];
    bool side[3];
    for (int i = 0; i < 3; ++i) {
      Triple q = p;
      q[axis] += i * size[axis];
      side[i] = brick->inside(q[0], q[1], q[2]);
    }
    if (side[0] != side[1] && side[1] != side[2]) return false;
    some |= side[0] || side[2];
    all &= side[0] && side[2];
  }
  if (!some || all) return false;
  if (!both) return true;
  // Rows along x, but across x along y.
  const int middle = low[axis] + size[axis];
  if (axis == 0) return one_arc(&rows[0][middle][low[2]], low[1], size[1], size[2]);
  if (axis == 1) return one_arc(&rows[1][middle][low[2]], low[0], size[0], size[2]);
  return one_arc(&rows[2][middle][low[1]], low[0], size[0], size[1]);
}

/// Merges a box with that beside it along \p axis where it may be.
void BrickMerger::Work::try_pair(std::size_t b, int axis) {
  Triple low = ints(made[b].region.low), size = ints(made[b].region.size), other = low;
  const bool is_high = (low[axis] & size[axis]) != 0;
  low[axis] &= ~size[axis];
  other[axis] += is_high ? -size[axis] : size[axis];
  const int beside = alive_at(other, size);
  if (beside == -2 || (is_high && beside >= 0)) return;  // which has tried it
  Moments sum = made[b].surface;
  if (beside >= 0) {
    if (!made[beside].disc) return;
    sum.add(made[beside].surface);
  }
  Triple both = size;
  both[axis] *= 2;
  const CellRegion region = region_of(low, both);
  if (!sum.is_flat(most_off(cells_of(low, both))) || refused(region)) return;
  if (!disc_again(low, size, axis, beside >= 0)) return;
  made[b].alive = false;
  if (beside >= 0) made[beside].alive = false;
  add(region, sum, true);
}

void BrickMerger::Work::merge() {
  brick->boxes.clear();
  brick->outlines.clear();
  outlines.clear();
  made.clear();
  covered = brick->active;
  if (!try_cube({0, 0, 0}, cells)) {
    for (int k = 0; k < 8; ++k) {
      const Triple low{2 * (k & 1), k & 2, k >> 1 & 2};
      const std::uint64_t some = brick->active & cells_of(low, {2, 2, 2});
      if (some == 0 || try_cube(low, 2)) continue;
      each_cell(some, [&](int x, int y, int z) {
        const int cell = Brick::cell_index(x, y, z);
        add(region_of({x, y, z}, {1, 1, 1}), surface[cell], (discs >> cell & 1) != 0);
      });
    }
    find_rows();
    for (int longest = 1; longest < cells; longest *= 2)
      for (int axis = 0; axis < 3; ++axis)
        for (std::size_t b = 0, count = made.size(); b < count; ++b) {
          const Made& box = made[b];
          if (box.alive && box.disc && box.region.size[axis] <= longest) try_pair(b, axis);
        }
  }
  finish();
}

/// Takes over what is not a part of something larger.
void BrickMerger::Work::finish() {
  for (const Made& box : made) {
    if (!box.alive) continue;
    const Triple low = ints(box.region.low), size = ints(box.region.size);
    const std::uint64_t some = brick->active & cells_of(low, size);
    if (box.outline < box.outline_end) {
      brick->outlines.insert(brick->outlines.end(), outlines.begin() + box.outline,
                             outlines.begin() + box.outline_end);
    } else if (!box.region.is_cell()) {
      int steps = 0;
      outline(low, size, steps);
      brick->outlines.insert(brick->outlines.end(), around.begin(), around.end());
    }
    const auto number = static_cast<std::uint8_t>(brick->boxes.size());
    each_cell(some,
              [&](int i, int j, int k) { brick->box_of[Brick::cell_index(i, j, k)] = number; });
    brick->boxes.push_back(
        {box.region, box.surface, 0.0f, static_cast<std::uint16_t>(brick->outlines.size())});
  }
}

BrickMerger::BrickMerger() : work_(std::make_unique<Work>()) {}
BrickMerger::~BrickMerger() = default;

void BrickMerger::merge(Brick& brick, const Level& fine, const Flatness& flatness) {
  Work& work = *work_;
  work.brick = &brick;
  work.flatness = flatness;
  work.find_crossings(fine);
  work.find_nodes();
  work.find_cells();
  work.merge();
}

}  // namespace polyhull::refine
