// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/contour/crossings.h"

#include <algorithm>

namespace polyhull::silhouette {
namespace {

// Coordinates have 25 bits, so this is exact.
std::int64_t orientation(std::int32_t ax, std::int32_t ay, std::int32_t bx, std::int32_t by,
                         std::int32_t cx, std::int32_t cy) {
  return static_cast<std::int64_t>(bx - ax) * (cy - ay) -
         static_cast<std::int64_t>(by - ay) * (cx - ax);
}

int sign(std::int64_t v) {
  return (v > 0) - (v < 0);
}

bool on_segment(std::int32_t ax, std::int32_t ay, std::int32_t bx, std::int32_t by, std::int32_t px,
                std::int32_t py) {
  return std::min(ax, bx) <= px && px <= std::max(ax, bx) && std::min(ay, by) <= py &&
         py <= std::max(ay, by);
}

bool meet(const CheckedEdge& e, const CheckedEdge& f) {
  const bool f_follows = f.follows(e), e_follows = e.follows(f);
  const int a = sign(orientation(e.ax, e.ay, e.bx, e.by, f.ax, f.ay));
  const int b = sign(orientation(e.ax, e.ay, e.bx, e.by, f.bx, f.by));
  if (f_follows || e_follows) {
    if (f_follows && e_follows) return true;  // two edges only
    // Neighbours share one corner; more only when one folds back onto the other.
    if (a != 0 || b != 0) return false;
    const std::int64_t along = static_cast<std::int64_t>(e.bx - e.ax) * (f.bx - f.ax) +
                               static_cast<std::int64_t>(e.by - e.ay) * (f.by - f.ay);
    return along < 0;
  }
  if (a * b > 0) return false;
  const int c = sign(orientation(f.ax, f.ay, f.bx, f.by, e.ax, e.ay));
  const int d = sign(orientation(f.ax, f.ay, f.bx, f.by, e.bx, e.by));
  if (c * d > 0) return false;
  if (a == 0 && on_segment(e.ax, e.ay, e.bx, e.by, f.ax, f.ay)) return true;
  if (b == 0 && on_segment(e.ax, e.ay, e.bx, e.by, f.bx, f.by)) return true;
  if (c == 0 && on_segment(f.ax, f.ay, f.bx, f.by, e.ax, e.ay)) return true;
  if (d == 0 && on_segment(f.ax, f.ay, f.bx, f.by, e.bx, e.by)) return true;
  return a * b < 0 && c * d < 0;
}

}  // namespace

void EdgeBands::build(const std::vector<CheckedEdge>& edges) {
  edges_ = &edges;
  begin_.clear();
  entries_.clear();
  if (edges.empty()) return;
  std::int32_t highest = edges[0].ay;
  std::int64_t total = 0;
  lowest_ = highest;
  for (const CheckedEdge& e : edges) {
    lowest_ = std::min({lowest_, e.ay, e.by});
    highest = std::max({highest, e.ay, e.by});
    total += std::abs(e.by - e.ay);
  }
  // About as high as the mean edge, so that an edge lies in two or three bands.
  height_ = static_cast<std::int32_t>(
      std::max<std::int64_t>(total / static_cast<std::int64_t>(edges.size()), 512));
  const std::size_t bands = static_cast<std::size_t>((highest - lowest_) / height_) + 1;
  begin_.assign(bands + 1, 0);
  const auto each_band = [&](const CheckedEdge& e, const auto& body) {
    const auto first = static_cast<std::size_t>((std::min(e.ay, e.by) - lowest_) / height_);
    const auto last = static_cast<std::size_t>((std::max(e.ay, e.by) - lowest_) / height_);
    for (std::size_t b = first; b <= last; ++b) body(b);
  };
  for (const CheckedEdge& e : edges) each_band(e, [&](std::size_t b) { ++begin_[b + 1]; });
  for (std::size_t b = 0; b < bands; ++b) begin_[b + 1] += begin_[b];
  entries_.resize(begin_[bands]);
  for (std::size_t i = 0; i < edges.size(); ++i)
    each_band(edges[i],
              [&](std::size_t b) { entries_[begin_[b]++] = static_cast<std::uint32_t>(i); });
  for (std::size_t b = bands; b > 0; --b) begin_[b] = begin_[b - 1];
  begin_[0] = 0;
  for (std::size_t b = 0; b < bands; ++b)
    std::sort(entries_.begin() + begin_[b], entries_.begin() + begin_[b + 1],
              [&](std::uint32_t i, std::uint32_t j) {
                const std::int32_t xi = std::min(edges[i].ax, edges[i].bx);
                const std::int32_t xj = std::min(edges[j].ax, edges[j].bx);
                return xi != xj ? xi < xj : i < j;
              });
}

void EdgeBands::find_crossings(
    const std::function<void(const CheckedEdge&, const CheckedEdge&)>& found) {
  for (std::size_t b = 0; b + 1 < begin_.size(); ++b)
    for (std::uint32_t i = begin_[b]; i < begin_[b + 1]; ++i) {
      const CheckedEdge& e = (*edges_)[entries_[i]];
      const std::int32_t right = std::max(e.ax, e.bx);
      const std::int32_t top = std::min(e.ay, e.by), bottom = std::max(e.ay, e.by);
      for (std::uint32_t j = i + 1; j < begin_[b + 1]; ++j) {
        const CheckedEdge& f = (*edges_)[entries_[j]];
        if (std::min(f.ax, f.bx) > right) break;
        if (std::min(f.ay, f.by) > bottom || std::max(f.ay, f.by) < top) continue;
        if (meet(e, f)) found(e, f);
      }
    }
}

int EdgeBands::crossings_right_of(std::int32_t x, std::int32_t y, std::uint32_t ring) const {
  if (begin_.size() < 2) return 0;
  const auto band = static_cast<std::size_t>((y - lowest_) / height_);
  int count = 0;
  for (std::uint32_t i = begin_[band]; i < begin_[band + 1]; ++i) {
    const CheckedEdge& e = (*edges_)[entries_[i]];
    if (e.ring == ring || (e.ay <= y) == (e.by <= y)) continue;
    const std::int64_t side = orientation(e.ax, e.ay, e.bx, e.by, x, y);
    // The edge is right of the point when the point is on its left seen along growing y.
    if (e.by > e.ay ? side > 0 : side < 0) ++count;
  }
  return count;
}

}  // namespace polyhull::silhouette
