// SPDX-License-Identifier: LGPL-2.1-or-later
// Gives a fitted ring the traced ring's area back.
//
// Corners held back by the tolerance, at tips above all, cut more off than they add. With e_r the
// signed area between edge r and its run, the sum of all e_r is the difference of the rings' areas.
// Moving corner v between its neighbours a and b by s along the normal of ab changes the area by
// s |ab| / 2. Every corner takes the same share of what the ring lacks, as far as both its edges
// stay within the tolerance.
#include <algorithm>
#include <cmath>

#include "silhouette/contour/ring_fit.h"

namespace polyhull::silhouette {
namespace {

double cross(double ax, double ay, double bx, double by) {
  return ax * by - bx * ay;
}

}  // namespace

// Area that edge r encloses beyond its run, in the orientation of the shoelace formula.
double RingFit::excess(std::size_t r) const {
  const FitNode &a = nodes_[r], &b = nodes_[after(r)];
  const int first = a.point, last = last_point(r);
  const double ax = a.vertex.x - points_[0].x, ay = a.vertex.y - points_[0].y;
  const double bx = b.vertex.x - points_[0].x, by = b.vertex.y - points_[0].y;
  const double traced = memory_->sums[last + 1].cross() - memory_->sums[first + 1].cross();
  return 0.5 * (cross(ax, ay, bx, by) - cross(ax, ay, x_[first], y_[first]) - traced -
                cross(x_[last], y_[last], bx, by));
}

// Moves corner r where both its edges stay within the tolerance, else leaves it. Its break follows
// to the nearest traced point.
bool RingFit::try_vertex(std::size_t r, Vec2f to) {
  const std::size_t before = r == 0 ? nodes_.size() - 1 : r - 1;
  FitNode& node = nodes_[r];
  const FitNode old = node;
  const double px = static_cast<double>(to.x) - points_[0].x;
  const double py = static_cast<double>(to.y) - points_[0].y;
  const auto distance = [&](int i) {
    return (x_[i] - px) * (x_[i] - px) + (y_[i] - py) * (y_[i] - py);
  };
  double nearest = distance(node.point);
  if (r > 0) {  // runs do not reach across point 0
    const int low = nodes_[before].point + 1, high = last_point(r) - 1;
    for (const int direction : {-1, 1})
      for (int i = old.point + direction; i >= low && i <= high; i += direction) {
        const double d = distance(i);
        if (d >= nearest) break;
        nearest = d;
        node.point = i;
      }
  }
  const double most = tolerance_ - margin_;
  if (nearest <= most * most) {
    node.vertex = to;
    // Points come no farther from an edge than its end moves; only where that is too much, or
    // points change sides of the corner, they are looked at.
    const double step = node.point == old.point ? glm::distance(old.vertex, to) : 2.0 * most;
    double left = nodes_[before].deviation + step, right = old.deviation + step;
    if (left > most) left = deviation(before);
    if (left <= most && right > most) right = deviation(r);
    if (left <= most && right <= most) {
      nodes_[before].deviation = left;
      node.deviation = right;
      node.pinned = false;
      return true;
    }
  }
  node = old;
  return false;
}

// Moves corner r so that the ring's area grows by `area` (in the formula's orientation), unless
// that breaks the tolerance.
bool RingFit::grow_at(std::size_t r, double area) {
  const Vec2f a = nodes_[r == 0 ? nodes_.size() - 1 : r - 1].vertex, b = nodes_[after(r)].vertex;
  const double dx = static_cast<double>(b.x) - a.x, dy = static_cast<double>(b.y) - a.y;
  const double chord = std::sqrt(dx * dx + dy * dy);
  if (chord < 1.0) return false;
  // cross(n, b - a) = |ab| for n = (dy, -dx) / |ab|.
  const double step = std::clamp(2.0 * area / chord, -0.5 * tolerance_, 0.5 * tolerance_) / chord;
  const Vec2f v = nodes_[r].vertex;
  return try_vertex(r, snapped(v.x + step * dy, v.y - step * dx));
}

void RingFit::restore_area() {
  constexpr double enough = 0.02;  // px of bias that are left
  const std::size_t m = nodes_.size();
  if (m < 3) return;
  marked.assign(m, 0);  // corners that cannot move
  for (std::size_t r = 0; r < m; ++r) marked[r] = nodes_[r].kept;
  for (int sweep = 0; sweep < 4; ++sweep) {
    double lacking = 0.0, all = 0.0, chords = 0.0;
    for (std::size_t r = 0; r < m; ++r) {
      lacking -= excess(r);
      const double chord =
          glm::distance(nodes_[r == 0 ? m - 1 : r - 1].vertex, nodes_[after(r)].vertex);
      all += chord;
      if (marked[r] == 0) chords += chord;
    }
    // Chords span two edges each.
    if (std::abs(lacking) <= 0.5 * enough * all || chords <= 0.0) return;
    // What some corners cannot take the others get in the next sweep.
    for (std::size_t r = 0; r < m; ++r) {
      if (marked[r] != 0) continue;
      const double chord =
          glm::distance(nodes_[r == 0 ? m - 1 : r - 1].vertex, nodes_[after(r)].vertex);
      marked[r] = !grow_at(r, lacking * chord / chords);
    }
  }
}

}  // namespace polyhull::silhouette
