// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/surface/patch_optimizer.h"

#include <algorithm>
#include <cmath>

namespace polyhull::hull {
namespace {

constexpr std::uint32_t turned_cost = 1u << 20, flat_cost = 1u << 10, sliver_cost = 1;
/// Corners of a patch, at most: its triangulations take time with the third power.
constexpr std::size_t patch_corners = 24;

}  // namespace

bool may_join(const CornerKey& a, const CornerKey& b) {
  if (a[2] == apex_mark || b[2] == apex_mark) return true;
  int shared = 0;
  for (int i = 0, j = 0; i < 3 && j < 3;)
    if (a[i] == b[j])
      ++shared, ++i, ++j;
    else
      a[i] < b[j] ? ++i : ++j;
  return shared < 2;
}

PatchOptimizer::Cost PatchOptimizer::cost(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
  const Vec3 &p = points_[a], &q = points_[b], &r = points_[c];
  const Vec3 twice_area = glm::cross(q - p, r - p);
  const double longest =
      std::sqrt(std::max({glm::dot(q - p, q - p), glm::dot(r - q, r - q), glm::dot(p - r, p - r)}));
  // The bound keeps the sum meaningful where there is no area.
  const double length =
      std::min(longest * longest / std::max(glm::length(twice_area), 1e-300), 1e9);
  switch (shape_of(p, q, r, normal_)) {
    case Shape::broken: {
      const bool turned = glm::dot(twice_area, normal_) < -4 * rounding_ * longest;
      return {turned ? turned_cost : flat_cost, length};
    }
    case Shape::sliver:
      return {sliver_cost, length};
    case Shape::good:
      break;
  }
  return {0, length};
}

PatchOptimizer::Cost PatchOptimizer::cost_of(std::uint32_t t) const {
  return cost(triangles_[3 * t], triangles_[3 * t + 1], triangles_[3 * t + 2]);
}

void PatchOptimizer::connect() {
  const std::uint32_t half_edges = static_cast<std::uint32_t>(triangles_.size());
  joined_half_edges_ += half_edges;
  opposite_.assign(half_edges, none);
  mesh_ = {triangles_, opposite_};
  sorted_.clear();
  for (std::uint32_t h = 0; h < half_edges; ++h) {
    const std::uint32_t a = mesh_.from(h), b = mesh_.to(h);
    sorted_.push_back(static_cast<std::uint64_t>(std::min(a, b)) << 44 |
                      static_cast<std::uint64_t>(std::max(a, b)) << 24 | h);
  }
  std::sort(sorted_.begin(), sorted_.end());
  tangled_ = false;
  for (std::size_t i = 0; i + 2 < sorted_.size(); ++i)
    tangled_ |= sorted_[i] >> 24 == sorted_[i + 2] >> 24;
  for (std::size_t i = 0; i + 1 < sorted_.size(); ++i)
    if (sorted_[i] >> 24 == sorted_[i + 1] >> 24)
      mesh_.link(sorted_[i] & 0xffffff, sorted_[i + 1] & 0xffffff);
}

/// Triangles around a bad one, nearest first, while the patch stays a disc with no vertex twice on
/// its border.
void PatchOptimizer::gather(std::uint32_t first) {
  patch_.assign(1, first);
  loop_.clear(), side_.clear();
  for (std::uint32_t k = 0; k < 3; ++k) {
    loop_.push_back(triangles_[3 * first + k]);
    side_.push_back(3 * first + k);
  }
  for (bool grown = true; grown && loop_.size() < patch_corners;) {
    grown = false;
    const std::size_t corners = loop_.size();
    for (std::size_t i = corners; i-- > 0 && loop_.size() < patch_corners;) {
      const std::uint32_t g = opposite_[side_[i]];
      if (g == none) continue;
      const std::uint32_t apex = mesh_.apex(g);
      if (std::find(loop_.begin(), loop_.end(), apex) != loop_.end()) continue;
      patch_.push_back(g / 3);
      // side i ran a -> b, g runs b -> a: now a -> apex -> b.
      const auto at = static_cast<std::ptrdiff_t>(i);
      side_[i] = following(g);
      loop_.insert(loop_.begin() + at + 1, apex);
      side_.insert(side_.begin() + at + 1, following(following(g)));
      grown = true;
    }
  }
}

/// Whether the triangle is good, and higher than anything that rounding could do.
bool PatchOptimizer::clear(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
  const Vec3 &p = points_[a], &q = points_[b], &r = points_[c];
  if (shape_of(p, q, r, normal_) != Shape::good) return false;
  const double longest =
      std::max({glm::dot(q - p, q - p), glm::dot(r - q, r - q), glm::dot(p - r, p - r)});
  return glm::length(glm::cross(q - p, r - p)) > 32 * rounding_ * std::sqrt(longest);
}

/// Which pairs of the loop's corners may become edges.
void PatchOptimizer::find_sides() {
  const std::size_t n = loop_.size();
  sides_.assign(n * n, free_side);
  const auto set = [&](std::size_t i, std::size_t j, Side side) {
    sides_[i * n + j] = sides_[j * n + i] = side;
  };
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 1; j < n; ++j) {
      if (may_join(keys_[loop_[i]], keys_[loop_[j]])) continue;
      const bool border = j == i + 1 || (i == 0 && j + 1 == n);
      const std::uint32_t h = j == i + 1 ? side_[i] : side_[n - 1];
      if (!border || opposite_[h] != none) set(i, j, clear_side);
    }
  // Edges that the triangles beside the patch have.
  if (3 * patch_.size() == triangles_.size()) return;
  if (!counted_) {
    edges_.clear(triangles_.size());
    for (std::uint32_t h = 0; h < triangles_.size(); ++h) edges_.add(mesh_.from(h), mesh_.to(h));
    counted_ = true;
  }
  count_patch(-1);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 2; j < n; ++j)
      if ((i > 0 || j + 1 < n) && edges_.contains(loop_[i], loop_[j])) set(i, j, taken_side);
  count_patch(1);
}

/// Enters the half-edges of the patch's triangles into edges_, or takes them out.
void PatchOptimizer::count_patch(int sign) {
  for (const std::uint32_t t : patch_)
    for (std::uint32_t h = 3 * t; h < 3 * t + 3; ++h) {
      const std::uint32_t a = mesh_.from(h), b = mesh_.to(h);
      sign > 0 ? edges_.add(a, b) : edges_.remove(a, b);
    }
}

/// Joins the half-edges of the patch's new triangles with each other and with what lies beyond the
/// patch's border: beyond_[i] at the edge from loop_[i].
void PatchOptimizer::connect_patch() {
  joined_half_edges_ += 3 * patch_.size();
  open_half_edges_.clear();
  const std::size_t n = loop_.size();
  for (const std::uint32_t t : patch_)
    for (std::uint32_t h = 3 * t; h < 3 * t + 3; ++h) {
      const std::uint32_t a = mesh_.from(h), b = mesh_.to(h);
      const std::size_t i = std::find(loop_.begin(), loop_.end(), a) - loop_.begin();
      if (loop_[(i + 1) % n] == b) {
        mesh_.link(h, beyond_[i]);
        continue;
      }
      const auto other =
          std::find_if(open_half_edges_.begin(), open_half_edges_.end(),
                       [&](std::uint32_t g) { return mesh_.from(g) == b && mesh_.to(g) == a; });
      if (other == open_half_edges_.end()) {
        open_half_edges_.push_back(h);
      } else {
        mesh_.link(h, *other);
        *other = open_half_edges_.back();
        open_half_edges_.pop_back();
      }
    }
}

/// Replaces the patch's triangles if there is anything better.
bool PatchOptimizer::solve() {
  const std::size_t n = loop_.size();
  find_sides();
  const auto side = [&](std::size_t i, std::size_t j) { return sides_[i * n + j]; };
  costs_.assign(n * n, {});
  middle_.assign(n * n, none);
  for (std::size_t step = 2; step < n; ++step)
    for (std::size_t i = 0; i + step < n; ++i) {
      const std::size_t j = i + step;
      if (side(i, j) == taken_side) continue;
      Cost best;
      std::uint32_t middle = none;
      for (std::size_t k = i + 1; k < j; ++k) {
        if ((k > i + 1 && middle_[i * n + k] == none) || (k + 1 < j && middle_[k * n + j] == none))
          continue;
        const Cost sides = costs_[i * n + k] + costs_[k * n + j];
        if (middle != none && !(sides < best)) continue;
        const bool must_be_clear =
            side(i, j) != free_side || side(i, k) != free_side || side(k, j) != free_side;
        if (must_be_clear && !clear(loop_[i], loop_[k], loop_[j])) continue;
        const Cost all = sides + cost(loop_[i], loop_[k], loop_[j]);
        if (middle == none || all < best) best = all, middle = static_cast<std::uint32_t>(k);
      }
      costs_[i * n + j] = best;
      middle_[i * n + j] = middle;
    }
  if (middle_[n - 1] == none) return false;
  Cost now;
  for (std::uint32_t t : patch_) now = now + cost_of(t);
  if (costs_[n - 1].bad >= now.bad) return false;
  result_.clear();
  open_.assign(1, {0, n - 1});
  while (!open_.empty()) {
    const auto [i, j] = open_.back();
    open_.pop_back();
    if (j - i < 2) continue;
    const std::size_t k = middle_[i * n + j];
    result_.insert(result_.end(), {loop_[i], loop_[k], loop_[j]});
    open_.emplace_back(i, k);
    open_.emplace_back(k, j);
  }
  std::sort(patch_.begin(), patch_.end());
  beyond_.clear();
  for (const std::uint32_t h : side_) beyond_.push_back(opposite_[h]);
  if (counted_) count_patch(-1);
  for (std::size_t i = 0; i < patch_.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) triangles_[3 * patch_[i] + k] = result_[3 * i + k];
  if (counted_) count_patch(1);
  tangled_ ? connect() : connect_patch();
  return true;
}

void PatchOptimizer::improve(std::span<const Vec3> points, std::span<const CornerKey> keys,
                             const Vec3& normal, double rounding,
                             std::span<std::uint32_t> triangles) {
  rounding_ = rounding;
  points_ = points, keys_ = keys, normal_ = normal, triangles_ = triangles;
  joined_half_edges_ = seen_triangles_ = 0;
  if (triangles.size() < 6) return;
  connect();
  counted_ = false;
  const std::uint32_t count = static_cast<std::uint32_t>(triangles.size() / 3);
  // Each success leaves fewer bad triangles, so this ends.
  for (bool again = true; again;) {
    again = false;
    seen_triangles_ += count;
    for (std::uint32_t t = 0; t < count; ++t) {
      if (cost_of(t).bad == 0) continue;
      gather(t);
      if (patch_.size() >= 2 && solve()) again = true;
    }
  }
}

}  // namespace polyhull::hull
