// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/cell_table.h"

namespace polyhull::refine {
namespace {

using Loop = std::vector<std::uint8_t>;  // of edges

/// The corners of each face, counter-clockwise as seen from outside the cell.
constexpr int faces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                             {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

/// The edge between two corners that differ in one bit.
struct EdgeNumbers {
  int number[8][8];
  EdgeNumbers() {
    int next = 0;
    for (int axis = 0; axis < 3; ++axis)
      for (int k = 0; k < 8; ++k)
        if (!(k >> axis & 1)) number[k][k | 1 << axis] = number[k | 1 << axis][k] = next++;
  }
};

bool on_one_face(const EdgeNumbers& edges, int a, int b) {
  for (const auto& face : faces) {
    bool has_a = false, has_b = false;
    for (int i = 0; i < 4; ++i) {
      const int edge = edges.number[face[i]][face[(i + 1) % 4]];
      has_a |= edge == a;
      has_b |= edge == b;
    }
    if (has_a && has_b) return true;
  }
  return false;
}

/// The loops of crossed edges. On each face the surface runs from the edge by which one leaves a run
/// of inside corners to that by which one enters it.
std::vector<Loop> loops_of(const EdgeNumbers& edges, unsigned corners) {
  int next[12];
  for (int& e : next) e = -1;
  for (const auto& face : faces) {
    const auto inside = [&](int i) { return (corners >> face[i % 4] & 1) != 0; };
    for (int i = 0; i < 4; ++i) {
      if (!inside(i) || inside(i + 3)) continue;
      int last = i;
      while (inside(last + 1) && last < i + 3) ++last;
      const int enters = edges.number[face[(i + 3) % 4]][face[i]];
      const int leaves = edges.number[face[last % 4]][face[(last + 1) % 4]];
      next[enters] = leaves;
    }
  }
  std::vector<Loop> loops;
  bool done[12] = {};
  for (int e = 0; e < 12; ++e) {
    if (next[e] < 0 || done[e]) continue;
    Loop loop;
    for (int x = e; !done[x]; x = next[x]) {
      done[x] = true;
      loop.push_back(static_cast<std::uint8_t>(x));
    }
    loops.push_back(loop);
  }
  return loops;
}

/// Cuts ears off \p loop whose diagonals lie on no face; whether it can be cut up like that.
bool cut_up(const EdgeNumbers& edges, const Loop& loop, std::vector<std::uint8_t>& out) {
  const std::size_t n = loop.size();
  if (n == 3) {
    out.insert(out.end(), loop.begin(), loop.end());
    return true;
  }
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint8_t a = loop[i], b = loop[(i + 1) % n], c = loop[(i + 2) % n];
    if (on_one_face(edges, a, c)) continue;
    Loop rest = loop;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>((i + 1) % n));
    const std::size_t before = out.size();
    out.insert(out.end(), {a, b, c});
    if (cut_up(edges, rest, out)) return true;
    out.resize(before);
  }
  return false;
}

}  // namespace

CellTable::CellTable() {
  const EdgeNumbers numbers;
  for (int axis = 0, next = 0; axis < 3; ++axis)
    for (int k = 0; k < 8; ++k)
      if (!(k >> axis & 1))
        edges_[static_cast<std::size_t>(next++)] = {k & 1, k >> 1 & 1, k >> 2, axis};
  for (unsigned corners = 0; corners < 256; ++corners)
    for (const Loop& loop : loops_of(numbers, corners)) cut_up(numbers, loop, triangles_[corners]);
}

const CellTable& cell_table() {
  static const CellTable table;
  return table;
}

}  // namespace polyhull::refine
