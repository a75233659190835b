// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/surface/triangulate.h"

#include <algorithm>
#include <cmath>

#include "base/edge_key.h"

namespace polyhull::hull {
namespace {

constexpr std::uint32_t bridge = 0x80000000u;

}  // namespace

double Triangulator::turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
  return cross(flat_[b] - flat_[a], flat_[c] - flat_[a]);
}

bool Triangulator::allowed(std::uint32_t a, std::uint32_t b) const {
  return may_join(local_keys_[a], local_keys_[b]);
}

void Triangulator::triangulate(std::span<const Vec3f> vertices, std::span<const CornerKey> keys,
                               std::span<const std::uint32_t> loops,
                               std::span<const std::uint32_t> ends, std::uint32_t first,
                               const Vec3& normal, std::vector<std::uint32_t>& triangles) {
  const std::uint32_t count = ends.back() - first;
  if (count == 3) {
    triangles.insert(triangles.end(), loops.begin(), loops.begin() + 3);
    return;
  }
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(normal[k]) > std::abs(normal[axis])) axis = k;
  int u = (axis + 1) % 3, v = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(u, v);
  Vec3 along = Vec3(0.0);
  along[u] = 1.0;
  const Vec3 e1 = glm::normalize(glm::cross(normal, along)), e0 = glm::cross(e1, normal);
  flat_.resize(count), metric_.resize(count), number_.resize(count);
  points_.resize(count), local_keys_.resize(count);
  const Vec3 origin(vertices[loops[0]]);
  for (std::uint32_t i = 0; i < count; ++i) {
    number_[i] = loops[i];
    const Vec3 p = Vec3(vertices[loops[i]]) - origin;
    flat_[i] = {p[u], p[v]};
    metric_[i] = {glm::dot(p, e0), glm::dot(p, e1)};
    points_[i] = p;
    local_keys_[i] = keys[loops[i]];
  }
  double largest = 0.0;
  for (const std::uint32_t v : number_)
    for (int k = 0; k < 3; ++k)
      largest = std::max(largest, std::abs(static_cast<double>(vertices[v][k])));
  rounding_ = std::ldexp(largest, -23);
  local_.clear();
  if (count == 4 && ends.size() == 1) {
    // Either diagonal, whichever is allowed and rounder.
    const auto good = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
      return std::min(turn(a, b, c), turn(a, c, d));
    };
    const double q0 = good(0, 1, 2, 3), q1 = good(1, 2, 3, 0);
    bool second = q0 > 0 && q1 > 0 ? worse(0, 1, 2, 3) : q1 > q0;
    if (!allowed(second ? 1 : 0, second ? 3 : 2)) second = !second;
    if (second)
      local_ = {1, 2, 3, 1, 3, 0};
    else
      local_ = {0, 1, 2, 0, 2, 3};
  } else {
    careful_ = false;
    if (!cut_loops(ends, first)) {
      careful_ = true;
      cut_loops(ends, first);
    }
    flip_edges();
  }
  for (std::size_t t = 0; t < local_.size(); t += 3)
    if (shape_of(points_[local_[t]], points_[local_[t + 1]], points_[local_[t + 2]], normal) !=
        Shape::good) {
      optimizer_.improve(points_, local_keys_, normal, rounding_, local_);
      break;
    }
  for (std::uint32_t i : local_) triangles.push_back(number_[i]);
}

/// Fills loops_, loop_of_ and holes_.
void Triangulator::find_holes() {
  loops_.clear(), holes_.clear(), loop_of_.clear();
  for (std::uint32_t i = 0; i < starts_.size(); ++i) {
    Loop& loop = loops_.emplace_back(Loop{0.0, 0.0, starts_[i], i, false, false});
    for (std::uint32_t k = starts_[i]; k < starts_[i] + counts_[i]; ++k) {
      loop.area += cross(flat_[k] - flat_[starts_[i]], flat_[nodes_[k].next] - flat_[starts_[i]]);
      loop.perimeter += glm::length(flat_[nodes_[k].next] - flat_[k]);
      const Vec2 &p = flat_[k], &q = flat_[loop.rightmost];
      if (p.x > q.x || (p.x == q.x && p.y > q.y)) loop.rightmost = k;
      loop_of_.push_back(i);
    }
    // A loop whose direction rounding may have turned gets triangles of its own: joining what is no
    // hole would tie two parts of the surface together, closing a tiny hole harms nothing.
    loop.hole = loop.area < -8 * rounding_ * loop.perimeter;
    loop.joined = !loop.hole;
    if (loop.hole) holes_.push_back(i);
  }
  // From the right, so that a bridge to the right only meets loops that are joined already.
  std::sort(holes_.begin(), holes_.end(), [&](std::uint32_t a, std::uint32_t b) {
    const Vec2 &p = flat_[loops_[a].rightmost], &q = flat_[loops_[b].rightmost];
    return p.x != q.x ? p.x > q.x : p.y != q.y ? p.y > q.y : a < b;
  });
}

/// The node of the joined loops that a bridge from \p p, to its right, leads to; none if there is
/// none.
std::uint32_t Triangulator::bridge_end(const Vec2& p) const {
  const auto place = [&](std::uint32_t node) { return flat_[nodes_[node].vertex]; };
  const auto joined = [&](std::uint32_t node) {
    return loops_[loops_[loop_of_[node]].owner].joined;
  };
  const std::uint32_t total = static_cast<std::uint32_t>(nodes_.size());
  // The nearest edge to the right of p that runs upwards has the face on its left, where p is.
  double best = 1e300;
  std::uint32_t target = none;
  for (std::uint32_t k = 0; k < total; ++k) {
    if (!joined(k)) continue;
    const Vec2 a = place(k), b = place(nodes_[k].next);
    if (!(a.y <= p.y && b.y >= p.y && a.y != b.y)) continue;
    const double x = a.x + (p.y - a.y) * (b.x - a.x) / (b.y - a.y);
    if (x >= p.x && x < best) best = x, target = a.x > b.x ? k : nodes_[k].next;
  }
  if (target == none) {
    // Rounding has put the hole onto or across the border: any bridge will do.
    double nearest = 1e300;
    for (std::uint32_t k = 0; k < total; ++k) {
      const double distance = glm::length(place(k) - p);
      if (joined(k) && distance < nearest) nearest = distance, target = k;
    }
    if (target == none) return none;
    best = p.x;
  }
  // A vertex inside the triangle (p, crossing, target) would hide the target: take the one at the
  // smallest angle to the right.
  const Vec2 q(best, p.y), t = place(target);
  double smallest = 1e300, nearest = 1e300;
  std::uint32_t chosen = target;
  const Vec2 lower = t.y < p.y ? t : q, upper = t.y < p.y ? q : t;
  for (std::uint32_t k = 0; k < total; ++k) {
    if (!joined(k)) continue;
    const Vec2 x = place(k);
    if (x.x < p.x) continue;
    if (cross(lower - p, x - p) < 0 || cross(upper - lower, x - lower) < 0 ||
        cross(p - upper, x - upper) < 0)
      continue;
    const Vec2 a = place(nodes_[k].previous), b = place(nodes_[k].next);
    // p must lie in the node's own sector.
    const bool convex = cross(x - a, b - x) > 0;
    const bool left_of_in = cross(x - a, p - a) > 0, left_of_out = cross(b - x, p - x) > 0;
    if (convex ? !(left_of_in && left_of_out) : !(left_of_in || left_of_out)) continue;
    const double angle = std::abs(x.y - p.y) / std::max(x.x - p.x, 1e-300);
    const double distance = glm::length(x - p);
    if (angle < smallest || (angle == smallest && distance < nearest))
      smallest = angle, nearest = distance, chosen = k;
  }
  return chosen;
}

/// Joins two nodes: outer ... end -> m ... (around the hole) ... m' -> end' ...
void Triangulator::build_bridge(std::uint32_t m, std::uint32_t end) {
  const std::uint32_t m2 = static_cast<std::uint32_t>(nodes_.size()), end2 = m2 + 1;
  nodes_.push_back({nodes_[m].vertex, nodes_[m].previous, end2, bridge + end});
  nodes_.push_back({nodes_[end].vertex, m2, nodes_[end].next, nodes_[end].beyond});
  if (nodes_[end2].beyond != none) nodes_[nodes_[end2].beyond - bridge].beyond = bridge + end2;
  nodes_[end].beyond = bridge + m2;
  nodes_[nodes_[m].previous].next = m2;
  nodes_[nodes_[end].next].previous = end2;
  nodes_[end].next = m;
  nodes_[m].previous = end;
}

/// Joins each hole to the outer loop around it by a bridge, so that only outer loops are left.
void Triangulator::join_holes() {
  find_holes();
  for (const std::uint32_t h : holes_) {
    const std::uint32_t m = loops_[h].rightmost, end = bridge_end(flat_[m]);
    if (end == none) continue;
    build_bridge(m, end);
    const std::uint32_t into = loops_[loop_of_[end]].owner;
    loop_of_.insert(loop_of_.end(), 2, into);
    counts_[into] += counts_[h] + 2;
    loops_[h].joined = true;
    for (Loop& loop : loops_)
      if (loop.owner == h) loop.owner = into;
  }
  std::size_t kept = 0;
  for (std::uint32_t i = 0; i < loops_.size(); ++i)
    if (loops_[i].owner == i) starts_[kept] = starts_[i], counts_[kept++] = counts_[i];
  starts_.resize(kept), counts_.resize(kept);
}

bool Triangulator::ear(std::uint32_t node, bool loose) const {
  const std::uint32_t a = nodes_[nodes_[node].previous].vertex, b = nodes_[node].vertex,
                      c = nodes_[nodes_[node].next].vertex;
  if (!(turn(a, b, c) > 0)) return false;
  const Vec2 p = flat_[a], q = flat_[b], r = flat_[c];
  const double x0 = std::min({p.x, q.x, r.x}), x1 = std::max({p.x, q.x, r.x});
  const double y0 = std::min({p.y, q.y, r.y}), y1 = std::max({p.y, q.y, r.y});
  for (std::uint32_t k = nodes_[nodes_[node].next].next; k != nodes_[node].previous;
       k = nodes_[k].next) {
    const std::uint32_t v = nodes_[k].vertex;
    const Vec2 x = flat_[v];
    if (x.x < x0 || x.x > x1 || x.y < y0 || x.y > y1) continue;
    if (v == a || v == b || v == c) continue;
    // A vertex on top of a corner, by rounding, may or may not lie inside.
    if (loose && (x == p || x == q || x == r)) continue;
    if (turn(a, b, v) >= 0 && turn(b, c, v) >= 0 && turn(c, a, v) >= 0) return false;
  }
  return true;
}

bool Triangulator::cut_loops(std::span<const std::uint32_t> ends, std::uint32_t first) {
  local_.clear(), opposite_.clear(), nodes_.clear(), starts_.clear(), counts_.clear(),
      used_.clear();
  std::uint32_t begin = 0;
  for (std::uint32_t end : ends) {
    end -= first;
    const std::uint32_t n = end - begin;
    for (std::uint32_t i = begin; i < end; ++i) nodes_.push_back({i, i - 1, i + 1, none});
    nodes_[begin].previous = end - 1;
    nodes_[end - 1].next = begin;
    starts_.push_back(begin);
    counts_.push_back(n);
    begin = end;
  }
  if (starts_.size() > 1) join_holes();
  if (careful_)
    for (const Node& node : nodes_) used_.insert(edge_key(node.vertex, nodes_[node.next].vertex));
  for (std::size_t i = 0; i < starts_.size(); ++i)
    if (!cut_ears(starts_[i], counts_[i])) return false;
  return true;
}

/// False: rounding has left the loop without an ear, and the work is not careful.
bool Triangulator::cut_ears(std::uint32_t start, std::uint32_t count) {
  std::uint32_t node = start, misses = 0;
  // Where there is no ear: first a vertex on top of its neighbour, then ears that only a vertex on
  // a corner hides, then what turns the right way, then any. Careful work does not use an edge
  // twice, which only loops that rounding has made to overlap could do.
  while (count > 3) {
    const std::uint32_t previous = nodes_[node].previous, next = nodes_[node].next;
    const std::uint32_t a = nodes_[previous].vertex, b = nodes_[node].vertex,
                        c = nodes_[next].vertex;
    if (misses > count && !careful_) return false;
    const bool unused = a != c && used_.count(edge_key(a, c)) == 0;
    bool cut = false;
    if (careful_ && !unused)
      cut = misses > 6 * count;
    else if (misses > 5 * count)
      cut = true;
    else if (misses > 4 * count)
      cut = turn(a, b, c) >= 0 && allowed(a, c);
    else if (misses > 2 * count)
      cut = ear(node, true) && (misses > 3 * count || allowed(a, c));
    else if (misses > count)
      cut = (flat_[b] == flat_[a] || flat_[b] == flat_[c]) && allowed(a, c);
    else
      cut = ear(node, false) && allowed(a, c);
    if (cut) {
      add_triangle(previous, node, next);
      if (careful_) used_.insert(edge_key(a, c));
      nodes_[previous].next = next;
      nodes_[next].previous = previous;
      nodes_[previous].beyond = static_cast<std::uint32_t>(local_.size()) - 1;
      --count;
      misses = 0;
      node = nodes_[next].next;  // not the neighbour: avoids fans of thin triangles
    } else {
      ++misses;
      node = next;
    }
  }
  if (count == 3) {
    const std::uint32_t next = nodes_[node].next;
    add_triangle(nodes_[node].previous, node, next);
    join_side(next, static_cast<std::uint32_t>(local_.size()) - 1);
  }
  return true;
}

/// The triangle of three nodes in a row, with the sides that they begin but for the last's.
void Triangulator::add_triangle(std::uint32_t first, std::uint32_t second, std::uint32_t third) {
  const std::uint32_t half_edge = static_cast<std::uint32_t>(local_.size());
  local_.insert(local_.end(), {nodes_[first].vertex, nodes_[second].vertex, nodes_[third].vertex});
  opposite_.insert(opposite_.end(), 3, none);
  join_side(first, half_edge);
  join_side(second, half_edge + 1);
}

/// The half-edge is the triangles' side of the edge from the node to the next.
void Triangulator::join_side(std::uint32_t node, std::uint32_t half_edge) {
  const std::uint32_t beyond = nodes_[node].beyond;
  if (beyond == none) return;
  if (beyond >= bridge)
    nodes_[beyond - bridge].beyond = half_edge;
  else
    HalfEdges{local_, opposite_}.link(half_edge, beyond);
}

/// Whether the diagonal a-c of the quadrilateral a b c d should become b-d: d lies inside the
/// circle through a, b, c.
bool Triangulator::worse(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) const {
  const Vec2 p = metric_[a] - metric_[d], q = metric_[b] - metric_[d], r = metric_[c] - metric_[d];
  const double pp = glm::dot(p, p), qq = glm::dot(q, q), rr = glm::dot(r, r);
  const double x = pp * cross(q, r), y = qq * cross(r, p), z = rr * cross(p, q);
  // A margin far above rounding keeps the flips from going in circles.
  return x + y + z > 1e-9 * (std::abs(x) + std::abs(y) + std::abs(z));
}

void Triangulator::flip_edges() {
  const std::uint32_t half_edges = static_cast<std::uint32_t>(local_.size());
  stack_.clear();
  for (std::uint32_t h = 0; h < half_edges; ++h)
    if (opposite_[h] != none && opposite_[h] > h) stack_.push_back(h);
  const HalfEdges mesh{local_, opposite_};
  std::size_t budget =
      64 + 16 * static_cast<std::size_t>(half_edges) * (half_edges < 64 ? half_edges : 64);
  while (!stack_.empty() && budget-- > 0) {
    const std::uint32_t h = stack_.back();
    stack_.pop_back();
    const std::uint32_t g = opposite_[h];
    if (g == none) continue;
    // Triangles (a, c, d) and (c, a, b) share a-c: h runs a -> c, g runs c -> a.
    const std::uint32_t a = mesh.from(h), c = mesh.from(g), d = mesh.apex(h), b = mesh.apex(g);
    const double before = std::min(turn(a, c, d), turn(c, a, b));
    const double after = std::min(turn(b, d, a), turn(b, c, d));
    const bool repair = before <= 0 && after > before;
    if (!repair && !(after > 0 && worse(a, b, c, d))) continue;
    if (b == d || !allowed(b, d)) continue;
    if (careful_) {
      if (used_.count(edge_key(b, d)) != 0) continue;
      used_.erase(edge_key(a, c));
      used_.insert(edge_key(b, d));
    }
    // Now (b, d, a) in place of h's triangle and (d, b, c) in place of g's.
    const std::uint32_t t0 = h / 3 * 3, t1 = g / 3 * 3;
    mesh.flip(h, t0, t1);
    for (std::uint32_t x : {t0 + 1, t0 + 2, t1 + 1, t1 + 2})
      if (opposite_[x] != none) stack_.push_back(x);
  }
}

}  // namespace polyhull::hull
