// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/contour/ring_fit.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "silhouette/pixels/kernels.h"

namespace polyhull::silhouette {

Vec2f snapped(double x, double y) {
  return {static_cast<float>(std::round(x * vertex_unit) / vertex_unit),
          static_cast<float>(std::round(y * vertex_unit) / vertex_unit)};
}

void RingFit::fit(std::span<const Vec2f> points, double tolerance, FitMemory& memory,
                  std::span<const RingNode> kept, std::uint32_t begin) {
  points_ = points;
  tolerance_ = tolerance;
  memory_ = &memory;
  nodes_.clear();
  const std::size_t n = points.size();
  x_.resize(n + 1);
  y_.resize(n + 1);
  memory.sums.resize(n + 2);
  const Vec2f origin = points[0];
  for (std::size_t i = 0; i < n; ++i) {
    x_[i] = points[i].x - origin.x;
    y_[i] = points[i].y - origin.y;
  }
  x_[n] = y_[n] = 0.0f;
  // The largest coordinate: floats without their sign are ordered as their bits are.
  std::int32_t largest = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const std::int32_t x = std::bit_cast<std::int32_t>(x_[i]) & 0x7fffffff;
    const std::int32_t y = std::bit_cast<std::int32_t>(y_[i]) & 0x7fffffff;
    largest = std::max(largest, std::max(x, y));
  }
  const float extent = std::bit_cast<float>(largest);

  margin_ = 0.002 + 2e-6 * extent;
  const auto with_run = [](const RingNode& node) { return node.run; };
  if (!kept.empty() && std::all_of(kept.begin(), kept.end(), with_run))
    return place_breaks(kept, begin);  // there is nothing to fit

  using Pair = FitMemory::Pair;
  FitMemory::Sums sum{};
  memory.sums[0] = sum;
  Pair last{};
  for (std::size_t i = 0; i <= n; ++i) {
    const Pair p = {x_[i], y_[i]}, turned = {p[1], p[0]};
    const Pair around = last * turned, product = p * turned;
    sum.x_y += p;
    sum.xx_yy += p * p;
    sum.cross_xy += Pair{around[0] - around[1], product[0]};
    last = p;
    memory.sums[i + 1] = sum;
  }
  place_breaks(kept, begin);
  relax();
  balance();
  settle();
  restore_area();
}

// The least-squares line through traced points [first, last].
RingFit::Line RingFit::line_of(int first, int last) const {
  const FitMemory::Sums &a = memory_->sums[first], &b = memory_->sums[last + 1];
  const double share = 1.0 / (last + 1 - first);
  const double mx = (b.x() - a.x()) * share, my = (b.y() - a.y()) * share;
  const double sxx = (b.xx() - a.xx()) * share - mx * mx;
  const double sxy = (b.xy() - a.xy()) * share - mx * my;
  const double syy = (b.yy() - a.yy()) * share - my * my;
  // The normal is the eigenvector of the smaller eigenvalue.
  const double d = sxx - syy, e = 2.0 * sxy, h = std::sqrt(d * d + e * e);
  double nx = 0.0, ny = 1.0;
  if (h > 1e-12) {
    // Of the half angle: cosine² = (1 + |d| / h) / 2, sine cosine = e / (2h).
    const double larger = h + std::abs(d), length = 1.0 / std::sqrt(2.0 * h * larger);
    const double cosine = larger * length, sine = e * length;
    // Direction (cosine, sine) for d > 0, (|sine|, ±cosine) for d < 0.
    if (d >= 0.0)
      nx = -sine, ny = cosine;
    else
      nx = -cosine, ny = sine;
  }
  return {nx, ny, nx * mx + ny * my};
}

bool RingFit::fits(int first, int last, double tolerance) const {
  if (last - first < 2) return true;
  const Line l = line_of(first, last);
  return kernels().line_deviation(x_.data() + first, y_.data() + first, last + 1 - first,
                                  static_cast<float>(l.nx), static_cast<float>(l.ny),
                                  static_cast<float>(l.c)) <= tolerance;
}

// The farthest point, up to `end`, that one line reaches from `first` within the tolerance.
int RingFit::longest(int first, int end, int guess, double tolerance) const {
  int good = std::min(first + 2, end);
  int step = std::max(guess, 2);
  int bad = end + 1;
  while (good < end) {
    const int next = std::min(first + step, end);
    if (next <= good) {
      step *= 2;
      continue;
    }
    if (!fits(first, next, tolerance)) {
      bad = next;
      break;
    }
    good = next;
    step += std::max(step / 2, 2);
  }
  while (bad - good > 1) {
    const int middle = good + (bad - good) / 2;
    if (middle > end) return end;
    if (fits(first, middle, tolerance))
      good = middle;
    else
      bad = middle;
  }
  return std::min(good, end);
}

// Runs from the last node to point `end`.
void RingFit::break_up(int end) {
  // A neighbouring pair of lines meets a little farther from the curve than each line is.
  // The rest is room for balance().
  const double tolerance = 0.88 * tolerance_ - margin_;
  const std::size_t first = nodes_.size() - 1;
  int guess = 16;
  for (int at = nodes_[first].point; at < end;) {
    if (at != nodes_[first].point) {
      FitNode node;
      node.point = at;
      nodes_.push_back(node);
    }
    const int next = longest(at, end, guess, tolerance);
    guess = next - at;
    at = next;
  }
  // The last run is what was left over; share it with the one before.
  if (nodes_.size() >= first + 2) {
    const int begin = nodes_[nodes_.size() - 2].point;
    nodes_.back().point = std::max(begin + 1, begin + (end - begin) / 2);
  }
}

void RingFit::place_breaks(std::span<const RingNode> kept, std::uint32_t begin) {
  const int n = static_cast<int>(points_.size());
  if (kept.empty()) {
    nodes_.emplace_back();
    break_up(n);
  }
  for (std::size_t i = 0; i < kept.size(); ++i) {
    FitNode node;
    node.point = static_cast<int>(kept[i].point - begin);
    node.vertex = kept[i].vertex;
    node.kept = true;
    node.dirty = !kept[i].run;
    nodes_.push_back(node);
    if (!kept[i].run)
      break_up(i + 1 < kept.size() ? static_cast<int>(kept[i + 1].point - begin) : n);
  }
  // A polygon has three corners at least.
  while (nodes_.size() < 3 && static_cast<int>(nodes_.size()) < n) {
    std::size_t widest = 0;
    for (std::size_t r = 1; r < nodes_.size(); ++r)
      if (last_point(r) - nodes_[r].point > last_point(widest) - nodes_[widest].point) widest = r;
    FitNode node;
    node.point = (nodes_[widest].point + last_point(widest)) / 2;
    nodes_[widest].dirty = true;
    nodes_.insert(nodes_.begin() + static_cast<std::ptrdiff_t>(widest) + 1, node);
  }
}

// Fits the lines, moves each break to where its two lines meet, and fits again.
void RingFit::relax() {
  const std::size_t m = nodes_.size();
  const auto fit_lines = [&] {
    for (std::size_t r = 0; r < m; ++r) {
      const Line l = line_of(nodes_[r].point, last_point(r));
      nodes_[r].nx = l.nx;
      nodes_[r].ny = l.ny;
      nodes_[r].c = l.c;
    }
  };
  fit_lines();
  for (int pass = 0; pass < 2; ++pass) {
    // The break at point 0 stays: runs do not reach across it.
    for (std::size_t r = 1; r < m; ++r) {
      const FitNode &a = nodes_[r - 1], &b = nodes_[r];
      const double cross = a.nx * b.ny - a.ny * b.nx;
      if (b.kept || std::abs(cross) < 0.05) continue;
      const double vx = (a.c * b.ny - b.c * a.ny) / cross, vy = (a.nx * b.c - b.nx * a.c) / cross;
      const auto distance = [&](int i) {
        const double dx = x_[i] - vx, dy = y_[i] - vy;
        return dx * dx + dy * dy;
      };
      const int low = nodes_[r - 1].point + 1, high = last_point(r) - 1;
      int at = nodes_[r].point;
      double best = distance(at);
      for (const int direction : {-1, 1})
        for (int i = at + direction; i >= low && i <= high; i += direction) {
          const double d = distance(i);
          if (d >= best) break;
          best = d;
          at = i;
        }
      nodes_[r].point = at;
    }
    fit_lines();
  }
}

// Shifts the lines so that each edge cuts off as much area as it adds: the points of a run are not
// evenly spaced, and what lies between the last point and the corner is not in the fit.
void RingFit::balance() {
  const std::size_t m = nodes_.size();
  for (std::size_t r = 0; r < m; ++r) place_vertex(r);
  const auto cross = [](double ax, double ay, double bx, double by) { return ax * by - bx * ay; };
  for (int pass = 0; pass < 2; ++pass) {
    for (std::size_t r = 0; r < m; ++r) {
      FitNode& node = nodes_[r];
      const int first = node.point, last = last_point(r);
      const Vec2f va = node.vertex, vb = nodes_[r + 1 < m ? r + 1 : 0].vertex;
      const double ax = va.x - points_[0].x, ay = va.y - points_[0].y;
      const double bx = vb.x - points_[0].x, by = vb.y - points_[0].y;
      const double length = std::hypot(bx - ax, by - ay);
      if (length < 1.0) continue;
      const double traced = memory_->sums[last + 1].cross() - memory_->sums[first + 1].cross();
      const double area = 0.5 * (cross(ax, ay, bx, by) - cross(ax, ay, x_[first], y_[first]) -
                                 traced - cross(x_[last], y_[last], bx, by));
      const double facing = cross(node.nx, node.ny, (bx - ax) / length, (by - ay) / length);
      if (std::abs(facing) < 0.5) continue;
      const double shift =
          std::clamp(-area / (length * facing), -0.3 * tolerance_, 0.3 * tolerance_);
      node.c += shift;
    }
    for (std::size_t r = 0; r < m; ++r) place_vertex(r);
  }
}

void RingFit::place_vertex(std::size_t r) {
  FitNode& node = nodes_[r];
  if (node.kept) return;
  const FitNode& before = nodes_[r == 0 ? nodes_.size() - 1 : r - 1];
  const Vec2f p = point(node.point);
  node.vertex = p;
  node.dirty = true;
  nodes_[r == 0 ? nodes_.size() - 1 : r - 1].dirty = true;
  if (node.pinned) return;
  const double px = x_[node.point], py = y_[node.point];
  const double cross = before.nx * node.ny - before.ny * node.nx;
  double vx, vy;
  if (std::abs(cross) > 0.02) {
    vx = (before.c * node.ny - node.c * before.ny) / cross;
    vy = (before.nx * node.c - node.nx * before.c) / cross;
  } else {
    // Nearly parallel: half way between the feet of the break on both lines.
    const double ea = before.nx * px + before.ny * py - before.c;
    const double eb = node.nx * px + node.ny * py - node.c;
    vx = px - 0.5 * (ea * before.nx + eb * node.nx);
    vy = py - 0.5 * (ea * before.ny + eb * node.ny);
  }
  double dx = vx - px, dy = vy - py;
  const double distance = std::sqrt(dx * dx + dy * dy), most = tolerance_ - margin_ - 0.003;
  if (distance > most) {
    const double scale = std::max(most, 0.0) / distance;
    dx *= scale;
    dy *= scale;
  }
  node.vertex = snapped(p.x + dx, p.y + dy);
}

// The largest distance of the run's traced points from its edge.
double RingFit::deviation(std::size_t r) const {
  const Vec2f a = nodes_[r].vertex, b = nodes_[r + 1 < nodes_.size() ? r + 1 : 0].vertex;
  const double dx = static_cast<double>(b.x) - a.x, dy = static_cast<double>(b.y) - a.y;
  const double length = std::sqrt(dx * dx + dy * dy);
  if (length == 0.0) return 1e9;
  const int first = nodes_[r].point, last = last_point(r);
  return std::sqrt(static_cast<double>(kernels().edge_deviation(
      x_.data() + first, y_.data() + first, last + 1 - first, a.x - points_[0].x,
      a.y - points_[0].y, static_cast<float>(dx / length), static_cast<float>(dy / length),
      static_cast<float>(length))));
}

// The traced point farthest from the chord of the run.
int RingFit::farthest(std::size_t r) const {
  const int first = nodes_[r].point, last = last_point(r);
  const double dx = static_cast<double>(x_[last]) - x_[first];
  const double dy = static_cast<double>(y_[last]) - y_[first];
  int best = (first + last) / 2;
  double most = -1.0;
  for (int i = first + 1; i < last; ++i) {
    const double ex = static_cast<double>(x_[i]) - x_[first];
    const double ey = static_cast<double>(y_[i]) - y_[first];
    const double d = dx == 0.0 && dy == 0.0 ? ex * ex + ey * ey : std::abs(ex * dy - ey * dx);
    if (d > most) most = d, best = i;
  }
  return best;
}

void RingFit::insert(std::size_t r, int at) {
  FitNode node;
  node.point = at;
  node.pinned = true;
  node.vertex = point(at);
  nodes_.insert(nodes_.begin() + static_cast<std::ptrdiff_t>(r) + 1, node);
  nodes_[r].dirty = true;
}

bool RingFit::refine(std::size_t r) {
  const std::size_t next = r + 1 < nodes_.size() ? r + 1 : 0;
  if (!nodes_[r].pinned || !nodes_[next].pinned) {
    nodes_[r].pinned = nodes_[next].pinned = true;
    nodes_[r].kept = nodes_[next].kept = false;
    place_vertex(r);
    place_vertex(next);
    return true;
  }
  if (last_point(r) - nodes_[r].point < 2) return false;
  insert(r, farthest(r));
  return true;
}

void RingFit::settle() {
  for (std::size_t r = 0; r < nodes_.size();) {
    if (!nodes_[r].dirty) {
      ++r;
      continue;
    }
    nodes_[r].dirty = false;
    nodes_[r].deviation = deviation(r);
    if (nodes_[r].deviation <= tolerance_ - margin_ || !refine(r)) {
      ++r;
      continue;
    }
    // The neighbours' corners may have moved: go back to the first that has.
    if (nodes_.back().dirty && r == 0) continue;
    r = r > 0 ? r - 1 : 0;
  }
  // The last run's corner at point 0 may have been moved by the first's refinement and vice versa.
  for (std::size_t r = 0; r < nodes_.size(); ++r)
    if (nodes_[r].dirty) return settle();
}

bool RingFit::refine_marked() {
  bool any = false;
  // From the end, so that insertions do not shift what is still to come.
  for (std::size_t r = std::min(marked.size(), nodes_.size()); r-- > 0;)
    if (marked[r]) any |= refine(r);
  settle();
  return any;
}

}  // namespace polyhull::silhouette
