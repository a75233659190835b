// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/surface/simplify.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "hull/surface/settle.h"

namespace polyhull::hull {
namespace {

/// One try at what is broken. Collapses may use up what vertices could have moved, so these may
/// move first; a finer grid has more places for them.
struct Way {
  bool settle_first;
  double grid;
};
constexpr std::array<Way, 4> ways{{{false, 1.0}, {true, 1.0}, {false, 0.5}, {true, 0.5}}};

}  // namespace

bool Simplifier::broken(const Vec3f& a, const Vec3f& b, const Vec3f& c, const Vec3& normal) {
  return shape_of(Vec3(a), Vec3(b), Vec3(c), normal) == Shape::broken;
}

Shape Simplifier::shape(std::uint32_t a, std::uint32_t b, std::uint32_t c,
                        std::uint32_t face) const {
  const auto& v = hull_->vertices;
  const Shape found = shape_of(Vec3(v[a]), Vec3(v[b]), Vec3(v[c]), normals_[face]);
  return found == Shape::sliver && !slivers_ ? Shape::good : found;
}

Shape Simplifier::shape(std::uint32_t t) const {
  const auto& i = hull_->triangles;
  return shape(i[3 * t], i[3 * t + 1], i[3 * t + 2], face_of_[t]);
}

/// Whether the triangles of the half-edges \p around, which leave one vertex, would cross others or
/// each other if that vertex were \p v. Two of them vanish.
bool Simplifier::would_cross(std::span<const std::uint32_t> around, std::uint32_t v,
                             std::uint32_t gone0, std::uint32_t gone1) {
  const auto& t = hull_->triangles;
  const std::uint32_t u = edges_.from(around[0]);
  std::vector<Corners> fresh;
  for (std::uint32_t k : around)
    if (k / 3 != gone0 && k / 3 != gone1)
      fresh.push_back({v, edges_.to(k), edges_.to(following(k))});
  const auto skip = [&](std::uint32_t s) {
    return dead_[s] || t[3 * s] == u || t[3 * s + 1] == u || t[3 * s + 2] == u;
  };
  for (std::size_t i = 0; i < fresh.size(); ++i) {
    if (guard_.crosses(fresh[i], skip)) return true;
    for (std::size_t j = 0; j < i; ++j)
      if (triangles_cross(hull_->vertices, fresh[i], fresh[j])) return true;
  }
  return false;
}

/// Moves the half-edge's start onto its end.
bool Simplifier::collapse(std::uint32_t h) {
  const std::uint32_t u = edges_.from(h), v = edges_.to(h), g = opposite_[h];
  const auto& p = hull_->vertices;
  const double length = glm::length(Vec3(p[u]) - Vec3(p[v]));
  const double moved = moved_[u] + length;
  if (moved > limit_) return false;
  const std::uint32_t x = edges_.apex(h), y = edges_.apex(g);
  if (x == y || edges_.valence(x) <= 3 || edges_.valence(y) <= 3) return false;
  std::vector<std::uint32_t> around;
  edges_.visit_leaving(u, [&](std::uint32_t k) { around.push_back(k); });
  int before = 0, after = 0;
  for (const std::uint32_t k : around) {
    const std::uint32_t other = edges_.to(k), t = k / 3;
    // Common neighbours are x and y alone.
    if (other != v && other != x && other != y && edges_.joined(other, v)) return false;
    const Shape now = shape(t);
    before += now != Shape::good;
    if (t != h / 3 && t != g / 3) {
      const std::uint32_t a = edges_.to(k), b = edges_.to(following(k));
      const Shape then = shape(v, a, b, face_of_[t]);
      after += then != Shape::good;
      if (slivers_ && then == Shape::broken && now != Shape::broken) return false;
      const Vec3 n0 = glm::cross(Vec3(p[a]) - Vec3(p[u]), Vec3(p[b]) - Vec3(p[u]));
      const Vec3 n1 = glm::cross(Vec3(p[a]) - Vec3(p[v]), Vec3(p[b]) - Vec3(p[v]));
      if (slivers_ && now == Shape::good &&
          glm::dot(n0, n1) < 0.7 * glm::length(n0) * glm::length(n1))
        return false;
    }
  }
  // Within the rounding any collapse that breaks no more than there was is progress: it leaves two
  // triangles fewer.
  if (slivers_ ? after >= before : after > before) return false;
  if (guarded_ && would_cross(around, v, h / 3, g / 3)) return false;
  for (std::uint32_t e : around) hull_->triangles[e] = v;
  if (guarded_)
    for (std::uint32_t e : around) guard_.update(e / 3);
  const std::uint32_t h1 = following(h), h2 = following(h1), g1 = following(g), g2 = following(g1);
  const std::uint32_t xv = opposite_[h1], vx = opposite_[h2], yv = opposite_[g1],
                      vy = opposite_[g2];
  edges_.link(xv, vx);
  edges_.link(yv, vy);
  leaving_[x] = xv;
  leaving_[y] = yv;
  leaving_[v] = vx;
  dead_[h / 3] = dead_[g / 3] = 1;
  edges_.visit_leaving(v, [&](std::uint32_t k) {
    if (shape(k / 3) != Shape::good) work_.push_back(k / 3);
  });
  moved_[v] = std::max(moved_[v], moved);
  return true;
}

/// Gives the half-edge's triangle, which is flat with its longest edge here, over to the neighbour.
bool Simplifier::flip(std::uint32_t h) {
  const std::uint32_t g = opposite_[h];
  const std::uint32_t h1 = following(h), h2 = following(h1), g1 = following(g), g2 = following(g1);
  const std::uint32_t a = edges_.from(h), b = edges_.to(h), c = edges_.to(h1), d = edges_.to(g1);
  if (c == d || edges_.joined(c, d) || edges_.valence(a) <= 3 || edges_.valence(b) <= 3)
    return false;
  const auto& p = hull_->vertices;
  const Vec3 edge = Vec3(p[b]) - Vec3(p[a]);
  const double length = glm::length(edge);
  const double height =
      length > 0 ? glm::length(glm::cross(edge, Vec3(p[c]) - Vec3(p[a]))) / length : 0;
  const double moved = std::max({moved_[a], moved_[b], moved_[c]}) + 2 * height;
  if (moved > limit_) return false;
  const std::uint32_t t0 = h / 3, t1 = g / 3, face = face_of_[t1];
  const bool merge = glm::length(Vec3(p[c]) - Vec3(p[d])) + moved <= limit_;
  const Shape n0 = shape(t0), n1 = shape(t1), m0 = shape(a, d, c, face), m1 = shape(d, b, c, face);
  const auto count = [](Shape s, Shape t, Shape limit) { return (s >= limit) + (t >= limit); };
  const int broken_then = count(m0, m1, Shape::broken);
  const int bad_now = count(n0, n1, Shape::sliver), bad_then = count(m0, m1, Shape::sliver);
  const bool better = broken_then == 0 && bad_then < bad_now;
  if (!merge && !better) return false;
  bool crossing = false;
  if (guarded_ && better) {
    const auto skip = [&](std::uint32_t s) { return dead_[s] || s == t0 || s == t1; };
    crossing = guard_.crosses({a, d, c}, skip) || guard_.crosses({d, b, c}, skip);
    if (crossing && !merge) return false;
  }
  const std::uint32_t old_face = face_of_[t0];
  // Triangles (a, b, c) and (b, a, d) become (a, d, c) and (d, b, c).
  const std::uint32_t bc = opposite_[h1], ca = opposite_[h2], ad = opposite_[g1],
                      db = opposite_[g2];
  const std::uint32_t i = 3 * t0, k = 3 * t1;
  edges_.flip(h, i + 1, k + 2);
  face_of_[t0] = face;
  const auto tell_guard = [&] {
    if (guarded_) guard_.update(t0), guard_.update(t1);
  };
  tell_guard();
  const double moved_before = std::exchange(moved_[c], moved);
  if (merge) {
    // Two flat triangles back to back: their tips c and d are one point.
    if (collapse(i + 1) || collapse(k + 2)) return true;
  }
  if (!better || crossing) {
    auto& t = hull_->triangles;
    t[i] = a, t[i + 1] = b, t[i + 2] = c;
    t[k] = b, t[k + 1] = a, t[k + 2] = d;
    edges_.link(i, k), edges_.link(i + 1, bc), edges_.link(i + 2, ca);
    edges_.link(k + 1, ad), edges_.link(k + 2, db);
    face_of_[t0] = old_face;
    leaving_[a] = i, leaving_[b] = k, leaving_[c] = i + 2, leaving_[d] = k + 2;
    moved_[c] = moved_before;
    tell_guard();
    return false;
  }
  for (std::uint32_t n : {t0, t1})
    if (shape(n) != Shape::good) work_.push_back(n);
  return true;
}

bool Simplifier::mend(std::uint32_t t) {
  const auto& p = hull_->vertices;
  std::array<std::pair<double, std::uint32_t>, 3> edges;
  for (std::uint32_t k = 0; k < 3; ++k) {
    const std::uint32_t h = 3 * t + k;
    edges[k] = {glm::length(Vec3(p[edges_.to(h)]) - Vec3(p[edges_.from(h)])), h};
  }
  std::sort(edges.begin(), edges.end());
  for (const auto& [length, h] : {edges[0], edges[1]})
    if (collapse(h) || collapse(opposite_[h])) return true;
  return flip(edges[2].second);
}

/// Mends while anything can be mended: each success leaves fewer bad triangles, so this ends.
bool Simplifier::mend_all() {
  bool changed = false;
  work_.clear();
  for (std::uint32_t t = 0; t < face_of_.size(); ++t)
    if (!dead_[t] && shape(t) != Shape::good) work_.push_back(t);
  std::vector<std::uint32_t> round;
  for (bool again = true; again;) {
    again = false;
    round.clear();
    round.swap(work_);
    std::sort(round.begin(), round.end());
    round.erase(std::unique(round.begin(), round.end()), round.end());
    for (std::uint32_t t : round) {
      if (dead_[t] || shape(t) == Shape::good) continue;
      if (mend(t))
        again = changed = true;
      else
        work_.push_back(t);
    }
  }
  return changed;
}

/// Takes out whole parts with broken triangles that are smaller than any move: rounding has left
/// them nothing to be seen.
bool Simplifier::drop_specks() {
  bool any = false;
  std::vector<std::uint32_t> part;
  for (std::uint32_t first = 0; first < face_of_.size(); ++first) {
    if (dead_[first] || shape(first) != Shape::broken) continue;
    const Vec3 middle(hull_->vertices[hull_->triangles[3 * first]]);
    bool small = true;
    part.assign(1, first);
    for (std::size_t i = 0; i < part.size() && small; ++i)
      for (std::uint32_t h = 3 * part[i]; h < 3 * part[i] + 3; ++h) {
        small =
            small && glm::length(Vec3(hull_->vertices[edges_.from(h)]) - middle) <= 0.5 * limit_;
        const std::uint32_t next = opposite_[h] / 3;
        if (std::find(part.begin(), part.end(), next) == part.end()) part.push_back(next);
      }
    if (!small) continue;
    for (const std::uint32_t t : part) dead_[t] = 1;
    any = true;
  }
  return any;
}

std::vector<std::uint32_t> Simplifier::all_broken() const {
  std::vector<std::uint32_t> broken;
  for (std::uint32_t t = 0; t < face_of_.size(); ++t)
    if (!dead_[t] && shape(t) == Shape::broken) broken.push_back(t);
  return broken;
}

/// Moves vertices around what is still broken; how many triangles stay so.
std::size_t Simplifier::settle_all(double grid) {
  const std::vector<std::uint32_t> broken = all_broken();
  if (broken.empty()) return 0;
  std::vector<Vec3f>& vertices = hull_->vertices;
  const std::vector<Vec3f> from = vertices;
  const SettlingMesh mesh{vertices, edges_, face_of_, normals_,    from,
                          moved_,   limit_, step_,    grid * step_};
  for (const std::uint32_t t : broken)
    if (shape(t) == Shape::broken) settle(mesh, t);
  for (std::size_t v = 0; v < from.size(); ++v)
    moved_[v] += glm::length(Vec3(vertices[v]) - Vec3(from[v]));
  return all_broken().size();
}

void Simplifier::simplify(Hull& hull, std::span<const Vec3> normals, double max_deviation) {
  hull_ = &hull;
  normals_ = normals;
  float largest = 0.0f;
  for (const Vec3f& v : hull.vertices)
    largest = std::max({largest, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  // A coordinate is off by half a unit in its last place, 2^-24 of the largest.
  const double rounding = std::ldexp(static_cast<double>(largest), -21);
  step_ = std::ldexp(1.0, std::ilogb(std::max(largest, 1e-30f)) - 23);
  connect();
  if (!manifold()) return;
  // First what is broken, within the rounding, then slivers.
  slivers_ = guarded_ = false;
  limit_ = rounding;
  bool changed = false;
  const auto mend_broken = [&](const Way& way) {
    if (way.settle_first) settle_all(way.grid);
    changed = mend_all();
    changed = drop_specks() || changed;
    return settle_all(way.grid);
  };
  const std::vector<Vec3f> vertices = hull.vertices;
  const std::vector<std::uint32_t> triangles = hull.triangles;
  const auto start_again = [&] {
    hull.vertices = vertices, hull.triangles = triangles;
    connect();
  };
  std::array<std::size_t, ways.size()> left{};
  std::size_t tried = 0;
  for (; tried < ways.size(); ++tried) {
    if (tried > 0) start_again();
    left[tried] = mend_broken(ways[tried]);
    if (left[tried] == 0) break;
  }
  if (tried == ways.size()) {
    start_again();
    mend_broken(ways[std::min_element(left.begin(), left.end()) - left.begin()]);
  }
  if (max_deviation > rounding) {
    slivers_ = guarded_ = true;
    limit_ = max_deviation;
    guard_.build(hull.vertices, hull.triangles);
    changed = mend_all() || changed;
  }
  if (changed) rebuild();
}

}  // namespace polyhull::hull
