// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/surface/crossing_guard.h"

#include <algorithm>
#include <cmath>

namespace polyhull::hull {
namespace {

/// The sign of the tetrahedron's volume, 0 where rounding could decide it.
int volume_sign(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 p = a - d, q = b - d, r = c - d;
  const double yz = q.y * r.z - q.z * r.y, zx = q.z * r.x - q.x * r.z, xy = q.x * r.y - q.y * r.x;
  const double volume = p.x * yz + p.y * zx + p.z * xy;
  const double size = std::abs(p.x) * (std::abs(q.y * r.z) + std::abs(q.z * r.y)) +
                      std::abs(p.y) * (std::abs(q.z * r.x) + std::abs(q.x * r.z)) +
                      std::abs(p.z) * (std::abs(q.x * r.y) + std::abs(q.y * r.x));
  const double error = 1e-15 * size;
  return volume > error ? 1 : volume < -error ? -1 : 0;
}

/// Whether the edge a-b passes through the inside of the triangle.
bool passes_through(const Vec3& a, const Vec3& b, const std::array<Vec3, 3>& t) {
  const int from = volume_sign(t[0], t[1], t[2], a);
  if (from == 0 || volume_sign(t[0], t[1], t[2], b) != -from) return false;
  const int turn = volume_sign(a, b, t[0], t[1]);
  return turn != 0 && volume_sign(a, b, t[1], t[2]) == turn &&
         volume_sign(a, b, t[2], t[0]) == turn;
}

}  // namespace

bool triangles_cross(std::span<const Vec3f> vertices, const Corners& a, const Corners& b) {
  const auto has = [](const Corners& c, std::uint32_t v) {
    return c[0] == v || c[1] == v || c[2] == v;
  };
  if (has(b, a[0]) + has(b, a[1]) + has(b, a[2]) >= 2) return false;
  const auto places = [&](const Corners& c) {
    return std::array<Vec3, 3>{Vec3(vertices[c[0]]), Vec3(vertices[c[1]]), Vec3(vertices[c[2]])};
  };
  const std::array<Vec3, 3> p = places(a), q = places(b);
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    // An edge that begins in a common corner cannot pass through the inside.
    if (!has(b, a[k]) && !has(b, a[next]) && passes_through(p[k], p[next], q)) return true;
    if (!has(a, b[k]) && !has(a, b[next]) && passes_through(q[k], q[next], p)) return true;
  }
  return false;
}

CrossingGuard::Box CrossingGuard::box_of(const Corners& c) const {
  const Vec3f &p = vertices_[c[0]], &q = vertices_[c[1]], &r = vertices_[c[2]];
  return {glm::min(glm::min(p, q), r), glm::max(glm::max(p, q), r)};
}

bool CrossingGuard::meet(const Box& a, const Box& b) {
  for (int k = 0; k < 3; ++k)
    if (a.low[k] > b.high[k] || b.low[k] > a.high[k]) return false;
  return true;
}

/// The node over the triangles order_[begin, end), which lie along a space-filling curve.
std::uint32_t CrossingGuard::grow_tree(std::uint32_t begin, std::uint32_t end,
                                       std::uint32_t parent) {
  const std::uint32_t number = static_cast<std::uint32_t>(nodes_.size());
  const std::uint32_t t = static_cast<std::uint32_t>(order_[begin]);
  nodes_.push_back({{}, parent, t, leaf});
  if (end - begin == 1) {
    nodes_[number].box = box_of(corners_of(t));
    leaf_of_[t] = number;
    return number;
  }
  const std::uint32_t middle = begin + (end - begin) / 2;
  const std::uint32_t first = grow_tree(begin, middle, number),
                      second = grow_tree(middle, end, number);
  const Box a = nodes_[first].box, b = nodes_[second].box;
  nodes_[number] = {{glm::min(a.low, b.low), glm::max(a.high, b.high)}, parent, first, second};
  return number;
}

void CrossingGuard::build(std::span<const Vec3f> vertices,
                          std::span<const std::uint32_t> triangles) {
  vertices_ = vertices, triangles_ = triangles;
  const std::uint32_t count = static_cast<std::uint32_t>(triangles.size() / 3);
  nodes_.clear();
  if (count == 0) return;
  nodes_.reserve(2 * count);
  leaf_of_.resize(count);
  order_.resize(count);
  Vec3f low = vertices[triangles[0]], high = low;
  for (const Vec3f& v : vertices) low = glm::min(low, v), high = glm::max(high, v);
  const Vec3f size = glm::max(high - low, Vec3f(1e-30f));
  const auto spread = [](std::uint64_t x) {  // 10 bits to every third place
    x = (x | x << 16) & 0x30000ff;
    x = (x | x << 8) & 0x300f00f;
    x = (x | x << 4) & 0x30c30c3;
    return (x | x << 2) & 0x9249249;
  };
  for (std::uint32_t t = 0; t < count; ++t) {
    const Box box = box_of(corners_of(t));
    const Vec3f at = (0.5f * (box.low + box.high) - low) / size * 1023.0f;
    std::uint64_t code = 0;
    for (int k = 0; k < 3; ++k)
      code |= spread(static_cast<std::uint64_t>(std::clamp(at[k], 0.0f, 1023.0f))) << k;
    order_[t] = code << 32 | t;
  }
  std::sort(order_.begin(), order_.end());
  grow_tree(0, count, leaf);
}

void CrossingGuard::update(std::uint32_t t) {
  const Box box = box_of(corners_of(t));
  std::uint32_t number = leaf_of_[t];
  nodes_[number].box = box;
  for (number = nodes_[number].parent; number != leaf; number = nodes_[number].parent) {
    Box& above = nodes_[number].box;
    above.low = glm::min(above.low, box.low), above.high = glm::max(above.high, box.high);
  }
}

}  // namespace polyhull::hull
