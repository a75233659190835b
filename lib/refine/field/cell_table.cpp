// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/field/cell_table.h"

#include <algorithm>

#include "base/vector.h"

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

/// Appends the steps on face \p number: from the edge by which one enters a run of inside corners to that by which one
/// leaves it. The faces' corners go around as seen from outside.
void add_steps(const EdgeNumbers& edges, unsigned corners, int number,
               std::vector<FaceStep>& steps) {
  const auto& face = faces[number];
  const auto inside = [&](int i) { return (corners >> face[i % 4] & 1) != 0; };
  for (int i = 0; i < 4; ++i) {
    if (!inside(i) || inside(i + 3)) continue;
    int last = i;
    while (inside(last + 1) && last < i + 3) ++last;
    const int enters = edges.number[face[(i + 3) % 4]][face[i]];
    const int leaves = edges.number[face[last % 4]][face[(last + 1) % 4]];
    steps.push_back({static_cast<std::uint8_t>(enters), static_cast<std::uint8_t>(leaves),
                     static_cast<std::uint8_t>(number)});
  }
}

/// The loops of crossed edges that \p steps make.
std::vector<Loop> loops_of(std::span<const FaceStep> steps) {
  int next[12];
  for (int& e : next) e = -1;
  for (const FaceStep& step : steps) next[step.from] = step.to;
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

/// Of the ways to cut \p loop into triangles without a diagonal on a face, the one with the least area
/// when the vertices are in the middle of their edges: it is the flattest, and its triangles keep
/// clear of each other wherever on their edges the vertices lie.
class FlattestCut {
 public:
  FlattestCut(const EdgeNumbers& numbers, const std::array<CellEdge, 12>& edges)
      : numbers_(numbers), edges_(edges) {}

  std::vector<std::uint8_t> cut(const Loop& loop) {
    least_ = 1e9;
    best_.clear();
    triangles_.clear();
    cut_ears(loop, 0.0);
    return best_;
  }

 private:
  double area(std::uint8_t a, std::uint8_t b, std::uint8_t c) const {
    const auto middle = [&](std::uint8_t index) {
      const CellEdge& edge = edges_[index];
      Vec3 point(edge.x, edge.y, edge.z);
      point[edge.axis] += 0.5;
      return point;
    };
    return glm::length(glm::cross(middle(b) - middle(a), middle(c) - middle(a)));
  }
  void cut_ears(const Loop& loop, double sum) {
    const std::size_t n = loop.size();
    if (n == 3) {
      sum += area(loop[0], loop[1], loop[2]);
      if (sum > least_ - 1e-9) return;
      least_ = sum;
      best_ = triangles_;
      best_.insert(best_.end(), loop.begin(), loop.end());
      return;
    }
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint8_t a = loop[i], b = loop[(i + 1) % n], c = loop[(i + 2) % n];
      if (on_one_face(numbers_, a, c)) continue;
      Loop rest = loop;
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>((i + 1) % n));
      triangles_.insert(triangles_.end(), {a, b, c});
      cut_ears(rest, sum + area(a, b, c));
      triangles_.resize(triangles_.size() - 3);
    }
  }

  const EdgeNumbers& numbers_;
  const std::array<CellEdge, 12>& edges_;
  double least_ = 0.0;
  std::vector<std::uint8_t> triangles_, best_;
};

}  // namespace

CellTable::CellTable() {
  const EdgeNumbers numbers;
  for (int axis = 0, next = 0; axis < 3; ++axis)
    for (int k = 0; k < 8; ++k)
      if (!(k >> axis & 1))
        edges_[static_cast<std::size_t>(next++)] = {k & 1, k >> 1 & 1, k >> 2, axis};
  FlattestCut flattest(numbers, edges_);
  for (unsigned corners = 0; corners < 256; ++corners) {
    std::vector<FaceStep> steps;
    for (int face = 0; face < 6; ++face) add_steps(numbers, corners, face, steps);
    for (const Loop& loop : loops_of(steps)) {
      for (const std::uint8_t edge : loop)
        steps_[corners].push_back(*std::find_if(
            steps.begin(), steps.end(), [&](const FaceStep& step) { return step.from == edge; }));
      const std::vector<std::uint8_t> cut = flattest.cut(loop);
      triangles_[corners].insert(triangles_[corners].end(), cut.begin(), cut.end());
      ++loops_[corners];
    }
  }
}

const CellTable& cell_table() {
  static const CellTable table;
  return table;
}

}  // namespace polyhull::refine
