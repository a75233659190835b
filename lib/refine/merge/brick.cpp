// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/merge/brick.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "refine/cell_table.h"

namespace polyhull::refine {
namespace {

/// Below this length of the mean unit normal the surface in a box turns too far for one polygon.
constexpr float least_mean_normal = 0.8f;

/// The bits of the cells of a box.
std::uint64_t cells_of(const std::array<int, 3>& low, const std::array<int, 3>& size) {
  constexpr std::uint64_t along[3][5] = {
      {0, 0x1, 0x3, 0, 0xf}, {0, 0x1, 0x11, 0, 0x1111}, {0, 0x1, 0x10001, 0, 0x1000100010001}};
  // Sums of disjoint bits: products.
  const std::uint64_t box = along[0][size[0]] * along[1][size[1]] * along[2][size[2]];
  return box << Brick::cell_index(low[0], low[1], low[2]);
}

template <typename Body>
void each_cell(std::uint64_t cells, const Body& body) {
  for (; cells != 0; cells &= cells - 1) {
    const int c = std::countr_zero(cells);
    body(c & 3, c >> 2 & 3, c >> 4);
  }
}

std::array<int, 3> ints(const std::array<std::uint8_t, 3>& from) {
  return {from[0], from[1], from[2]};
}

}  // namespace

unsigned CellBox::faces_at(const BrickEdge& edge) const {
  const int at[3] = {edge.x, edge.y, edge.z};
  unsigned faces = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == edge.axis) continue;
    faces |= unsigned(at[axis] == low[axis]) << 2 * axis;
    faces |= unsigned(at[axis] == low[axis] + size[axis]) << (2 * axis + 1);
  }
  return faces;
}

/// The boxes of single cells.
void Brick::add_cells(const std::array<float, 375>& crossings) {
  const CellTable& table = cell_table();
  each_cell(active, [&](int i, int j, int k) {
    const unsigned corners = pattern(i, j, k);
    CellBox box;
    box.low = {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(j),
               static_cast<std::uint8_t>(k)};
    box.disc = table.loops(corners) == 1;
    box.at_rim = (rims >> cell_index(i, j, k) & 1) != 0;
    const auto triangles = table.triangles(corners);
    float area = 0.0f, squares[6] = {};
    Vec3f sum(0.0f), normal(0.0f);
    for (std::size_t t = 0; t < triangles.size(); t += 3) {
      Vec3f p[3];
      for (std::size_t c = 0; c < 3; ++c) {
        const CellEdge& e = table.edge(triangles[t + c]);
        p[c] = Vec3f(i + e.x, j + e.y, k + e.z);
        p[c][e.axis] += crossings[edge_index({i + e.x, j + e.y, k + e.z, e.axis})];
      }
      const Vec3f turned = 0.5f * glm::cross(p[1] - p[0], p[2] - p[0]);
      const float size = glm::length(turned);
      const Vec3f three = p[0] + p[1] + p[2];
      area += size, sum += size / 3.0f * three, normal += turned;
      for (const Vec3f& q : {p[0], p[1], p[2], three}) {
        const Vec3f by_area = size / 12.0f * q;
        squares[0] += by_area.x * q.x, squares[1] += by_area.y * q.y, squares[2] += by_area.z * q.z;
        squares[3] += by_area.x * q.y, squares[4] += by_area.y * q.z, squares[5] += by_area.z * q.x;
      }
    }
    box.area = area, box.sum = sum, box.normal = normal;
    std::copy_n(squares, 6, box.squares);
    boxes.push_back(box);
    own(static_cast<int>(boxes.size()) - 1);
  });
}

void Brick::own(int b) {
  const CellBox& box = boxes[b];
  each_cell(active & cells_of(ints(box.low), ints(box.size)), [&](int i, int j, int k) {
    box_of[cell_index(i, j, k)] = static_cast<std::uint8_t>(b);
  });
}

/// The box that just fills a region; -1: it has no surface and is in no box, -2: neither.
int Brick::alive_at(const Triple& low, const Triple& size) const {
  const std::uint64_t cells = cells_of(low, size), surface = active & cells;
  if (surface == 0) return (covered & cells) == 0 ? -1 : -2;
  const int b = box_of[std::countr_zero(surface)];
  return ints(boxes[b].low) == low && ints(boxes[b].size) == size ? b : -2;
}

namespace {

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

}  // namespace

/// Whether two boxes side by side along \p axis make one whose surface is a disc that crosses each of its
/// edges once at most, and some. \p both: they both have surface.
bool Brick::disc_again(const Rows& rows, const Triple& low, const Triple& size, int axis,
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
      side[i] = inside(q[0], q[1], q[2]);
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

void Brick::try_merge(const Rows& rows, const CellBox& from, int axis, const Flatness& flatness) {
  Triple low = ints(from.low);
  const Triple size = ints(from.size);
  const bool is_high = (low[axis] & size[axis]) != 0;
  low[axis] &= ~size[axis];
  Triple other = low;
  if (!is_high) other[axis] += size[axis];
  const int beside = alive_at(other, size);
  if (beside == -2 || (is_high && beside >= 0)) return;  // which has tried it
  const CellBox empty;
  const CellBox& more = beside < 0 ? empty : boxes[beside];
  if (!more.disc) return;
  const Vec3f normal = from.normal + more.normal, sum = from.sum + more.sum;
  const float area = from.area + more.area, length = glm::length(normal);
  if (!(length > least_mean_normal * area)) return;
  float q[6];
  for (int s = 0; s < 6; ++s) q[s] = from.squares[s] + more.squares[s];
  const Vec3f n = normal / length;
  const float square = n.x * n.x * q[0] + n.y * n.y * q[1] + n.z * n.z * q[2] +
                       2.0f * (n.x * n.y * q[3] + n.y * n.z * q[4] + n.z * n.x * q[5]);
  const float off = glm::dot(n, sum) / area;
  const bool at_rim = from.at_rim || more.at_rim;
  const float most = at_rim ? flatness.at_rims : flatness.anywhere;
  if (!(square / area - off * off <= most * most)) return;
  if (!disc_again(rows, low, size, axis, beside >= 0)) return;
  CellBox box;
  for (int x = 0; x < 3; ++x) {
    box.low[x] = static_cast<std::uint8_t>(low[x]);
    box.size[x] = static_cast<std::uint8_t>(size[x] * (x == axis ? 2 : 1));
  }
  box.parts = {static_cast<std::int8_t>(&from - boxes.data()), static_cast<std::int8_t>(beside)};
  box.merged = true;
  box.at_rim = at_rim;
  box.area = area, box.sum = sum, box.normal = normal;
  std::copy_n(q, 6, box.squares);
  for (const int part : box.parts)
    if (part >= 0) boxes[part].alive = false;
  covered |= cells_of(low, ints(box.size));
  boxes.push_back(box);
  own(static_cast<int>(boxes.size()) - 1);
}

void Brick::merge(const Level& fine, const Flatness& flatness) {
  const Grid& grid = fine.grid;
  std::array<float, 375> crossings;
  const std::size_t step[3] = {1, grid.row(), grid.slab()};
  for (int k = 0; k < nodes; ++k)
    for (int j = 0; j < nodes; ++j) {
      const unsigned crossed[3] = {(signs[k][j] ^ signs[k][j] >> 1) & 0xfu,
                                   j < cells ? unsigned(signs[k][j] ^ signs[k][j + 1]) : 0u,
                                   k < cells ? unsigned(signs[k][j] ^ signs[k + 1][j]) : 0u};
      for (int axis = 0; axis < 3; ++axis)
        for (unsigned bits = crossed[axis]; bits != 0; bits &= bits - 1) {
          const int i = std::countr_zero(bits);
          const std::size_t node = grid.node(cells * x + i, cells * y + j, cells * z + k);
          const float at = crossing(fine.values[node], fine.values[node + step[axis]]);
          crossings[edge_index({i, j, k, axis})] = at;
          if (i < cells && j < cells && k < cells) along[own_edge({i, j, k, axis})] = at;
        }
    }
  Rows rows{};
  for (int a = 0; a < nodes; ++a)
    for (int b = 0; b < nodes; ++b) {
      for (int i = 0; i < nodes; ++i) rows[0][a][b] |= unsigned(inside(a, i, b)) << i;
      rows[1][a][b] = signs[b][a], rows[2][a][b] = signs[a][b];
    }
  boxes.clear();
  boxes.reserve(static_cast<std::size_t>(std::popcount(active)) + 63);  // references stay
  covered = active;
  add_cells(crossings);
  for (int longest = 1; longest < cells; longest *= 2)
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t count = boxes.size();
      for (std::size_t b = 0; b < count; ++b) {
        const CellBox& box = boxes[b];
        if (box.alive && box.disc && box.size[axis] <= longest)
          try_merge(rows, box, axis, flatness);
      }
    }
}

void Brick::split(int b) {
  boxes[b].alive = false;
  for (const int part : boxes[b].parts)
    if (part >= 0) boxes[part].alive = true, own(part);
}

void Brick::outline(const CellBox& box, std::vector<std::uint16_t>& edges) const {
  const CellTable& table = cell_table();
  std::array<std::uint16_t, 375> next;
  int first = -1;
  each_cell(active & cells_of(ints(box.low), ints(box.size)), [&](int i, int j, int k) {
    const int at[3] = {i, j, k};
    const unsigned corners = pattern(i, j, k);
    for (int face = 0; face < 6; ++face) {
      const int axis = face / 2;
      if (at[axis] != box.low[axis] + (face & 1 ? box.size[axis] - 1 : 0)) continue;
      for (const FaceStep& run : table.steps(corners, face)) {
        const auto index = [&](std::uint8_t edge) {
          const CellEdge& e = table.edge(edge);
          return edge_index({i + e.x, j + e.y, k + e.z, e.axis});
        };
        first = index(run.from);
        next[first] = static_cast<std::uint16_t>(index(run.to));
      }
    }
  });
  edges.clear();
  int here = first;
  do {
    edges.push_back(static_cast<std::uint16_t>(here));
    here = next[here];
  } while (here != first);
}

}  // namespace polyhull::refine
