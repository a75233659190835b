// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/surface/settle.h"

#include <algorithm>
#include <cmath>

#include "hull/surface/triangle_shape.h"

namespace polyhull::hull {
namespace {

/// Turns that the vertices take, and how often neighbours are taken along, before giving up.
constexpr int rounds = 32, rings = 3;
/// The height that triangles should have, in steps of the grid.
constexpr double least_height = 0.5;

class Settling {
 public:
  Settling(const SettlingMesh& mesh, std::uint32_t triangle) : mesh_(mesh) {
    take_corners(triangle);
  }

  bool run() {
    for (int ring = 0; ring < rings; ++ring) {
      bool better = true;
      for (int round = 0; better && round < rounds; ++round) {
        if (!any_broken()) return true;
        better = turn_edge();
        for (std::size_t i = 0; i < movable_.size(); ++i) better = move(movable_[i]) || better;
      }
      if (!any_broken()) return true;
      take_neighbours();
    }
    return false;
  }

 private:
  void take_corners(std::uint32_t triangle) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t v = mesh_.edges.triangles[3 * triangle + k];
      if (std::find(movable_.begin(), movable_.end(), v) == movable_.end()) movable_.push_back(v);
    }
  }

  /// Those of broken triangles first.
  void take_neighbours() {
    const std::size_t count = movable_.size();
    for (const bool all : {false, true}) {
      for (std::size_t i = 0; i < count; ++i)
        mesh_.edges.visit_leaving(movable_[i], [&](std::uint32_t h) {
          if (all || broken(h / 3)) take_corners(h / 3);
        });
      if (movable_.size() > count) return;
    }
  }

  Vec3 place(std::uint32_t vertex) const { return Vec3(mesh_.vertices[vertex]); }

  bool broken(std::uint32_t t) const {
    const std::uint32_t* v = &mesh_.edges.triangles[3 * t];
    return shape_of(place(v[0]), place(v[1]), place(v[2]), mesh_.normals[mesh_.face_of[t]]) ==
           Shape::broken;
  }

  bool any_broken() const {
    bool any = false;
    for (const std::uint32_t v : movable_)
      mesh_.edges.visit_leaving(v, [&](std::uint32_t h) { any = any || broken(h / 3); });
    return any;
  }

  /// By how much the triangle's height falls short.
  double shortage(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t face) const {
    const Vec3 ab = place(b) - place(a), bc = place(c) - place(b), ca = place(a) - place(c);
    const double longest =
        std::sqrt(std::max({glm::dot(ab, ab), glm::dot(bc, bc), glm::dot(ca, ca)}));
    const double area = glm::dot(glm::cross(ab, bc), mesh_.normals[face]);
    const double height = longest > 0 ? area / longest : 0.0;
    return std::max(0.0, least_height * mesh_.step - height);
  }
  double shortage(std::uint32_t t) const {
    const std::uint32_t* v = &mesh_.edges.triangles[3 * t];
    return shortage(v[0], v[1], v[2], mesh_.face_of[t]);
  }
  double shortage_around(std::uint32_t vertex) const {
    double sum = 0.0;
    mesh_.edges.visit_leaving(vertex, [&](std::uint32_t h) { sum += shortage(h / 3); });
    return sum;
  }

  /// Tries all places of the grid that the vertex may go to.
  bool move(std::uint32_t vertex) {
    double least = shortage_around(vertex);
    if (least == 0.0) return false;
    const double before = least, reach = mesh_.limit - mesh_.moved[vertex];
    const int steps = static_cast<int>(reach / mesh_.grid);
    const Vec3 from(mesh_.from[vertex]);
    Vec3f& now = mesh_.vertices[vertex];
    Vec3f best = now;
    double nearest = glm::length(Vec3(now) - from);
    for (int x = -steps; x <= steps; ++x)
      for (int y = -steps; y <= steps; ++y)
        for (int z = -steps; z <= steps; ++z) {
          now = Vec3f(from + mesh_.grid * Vec3(x, y, z));
          const double distance = glm::length(Vec3(now) - from);
          if (distance > reach) continue;
          const double sum = shortage_around(vertex);
          if (sum > least || (sum == least && distance >= nearest)) continue;
          least = sum, nearest = distance, best = now;
        }
    now = best;
    return least < before;
  }

  /// Turns an edge of a broken triangle, inside a face, into the other diagonal if that is better.
  bool turn_edge() {
    for (const std::uint32_t v : movable_) {
      std::uint32_t better = none;
      mesh_.edges.visit_leaving(v, [&](std::uint32_t first) {
        if (better != none || !broken(first / 3)) return;
        for (const std::uint32_t h : {first, following(first), following(following(first))})
          if (better == none && should_turn(h)) better = h;
      });
      if (better == none) continue;
      mesh_.edges.flip(better, better / 3 * 3 + 1, mesh_.edges.opposite[better] / 3 * 3 + 2);
      return true;
    }
    return false;
  }

  bool should_turn(std::uint32_t h) const {
    const HalfEdges& edges = mesh_.edges;
    const std::uint32_t g = edges.opposite[h], face = mesh_.face_of[h / 3];
    if (mesh_.face_of[g / 3] != face) return false;
    const std::uint32_t a = edges.from(h), b = edges.from(g), c = edges.apex(h), d = edges.apex(g);
    return c != d && edges.valence(a) > 3 && edges.valence(b) > 3 && !edges.joined(c, d) &&
           shortage(a, d, c, face) + shortage(d, b, c, face) < shortage(h / 3) + shortage(g / 3);
  }

  SettlingMesh mesh_;
  std::vector<std::uint32_t> movable_;
};

}  // namespace

bool settle(const SettlingMesh& mesh, std::uint32_t triangle) {
  return Settling(mesh, triangle).run();
}

}  // namespace polyhull::hull
