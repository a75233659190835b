// SPDX-License-Identifier: LGPL-2.1-or-later
// Gives a fitted ring the traced ring's area back.
//
// Corners held back by the tolerance, at tips above all, cut more off than they add. With e_r the
// signed area between edge r and its run, the sum of all e_r is the difference of the rings' areas.
// Moving corner v between its neighbours a and b by s along the normal of ab changes the area by
// s |ab| / 2, so each corner in turn takes half of what its two edges lack, and after that every
// corner its share of what the whole ring lacks: as far as both edges stay within the tolerance.
#include <algorithm>
#include <cmath>

#include "silhouette/ring_fit.h"

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
  const double traced = memory_->sums[last + 1].cross - memory_->sums[first + 1].cross;
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
  const auto distance = [&](int i) { return std::hypot(x_[i] - px, y_[i] - py); };
  int at = node.point;
  double nearest = distance(at);
  if (r > 0) {  // runs do not reach across point 0
    const int low = nodes_[before].point + 1, high = last_point(r) - 1;
    for (const int direction : {-1, 1})
      for (int i = at + direction; i >= low && i <= high; i += direction) {
        const double d = distance(i);
        if (d >= nearest) break;
        nearest = d;
        at = i;
      }
  }
  const double most = tolerance_ - margin_;
  if (nearest > most) return false;
  node.vertex = to;
  node.point = at;
  node.pinned = false;
  if (deviation(before) <= most && deviation(r) <= most) return true;
  node = old;
  return false;
}

// Moves corner r so that the ring's area grows by `area` (in the formula's orientation), or by as
// much of it as goes.
void RingFit::grow_at(std::size_t r, double area) {
  const Vec2f a = nodes_[r == 0 ? nodes_.size() - 1 : r - 1].vertex, b = nodes_[after(r)].vertex;
  const double dx = static_cast<double>(b.x) - a.x, dy = static_cast<double>(b.y) - a.y;
  const double chord = std::hypot(dx, dy);
  if (chord < 1.0) return;
  // cross(n, b - a) = |ab| for n = (dy, -dx) / |ab|.
  double step = std::clamp(2.0 * area / chord, -0.5 * tolerance_, 0.5 * tolerance_);
  const Vec2f v = nodes_[r].vertex;
  for (int attempt = 0; attempt < 3 && std::abs(step) > 1.0 / vertex_unit; ++attempt, step *= 0.5)
    if (try_vertex(r, snapped(v.x + step * dy / chord, v.y - step * dx / chord))) return;
}

void RingFit::restore_area() {
  const std::size_t m = nodes_.size();
  if (m < 3) return;
  for (int sweep = 0; sweep < 2; ++sweep)
    for (std::size_t r = 0; r < m; ++r)
      grow_at(r, -0.5 * (excess(r == 0 ? m - 1 : r - 1) + excess(r)));
  for (int sweep = 0; sweep < 6; ++sweep) {
    double lacking = 0.0, chords = 0.0;
    for (std::size_t r = 0; r < m; ++r) {
      lacking -= excess(r);
      chords += glm::distance(nodes_[r == 0 ? m - 1 : r - 1].vertex, nodes_[after(r)].vertex);
    }
    if (chords <= 0.0 || std::abs(lacking) < 0.002 * chords) return;
    // What some corners cannot take the others get in the next sweep.
    for (std::size_t r = 0; r < m; ++r)
      grow_at(r, lacking / chords *
                     glm::distance(nodes_[r == 0 ? m - 1 : r - 1].vertex, nodes_[after(r)].vertex));
  }
}

}  // namespace polyhull::silhouette
