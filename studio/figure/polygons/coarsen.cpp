// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/figure/polygons/coarsen.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <queue>
#include <tuple>
#include <utility>

namespace polyhull {
namespace {

/// Sum of areas times squared distances to planes: p a p + 2 b p + c.
struct Quadric {
  Mat3 a{0.0};
  Vec3 b{0.0};
  double c = 0.0, area = 0.0;

  void add(const Quadric& other) {
    a += other.a;
    b += other.b;
    c += other.c;
    area += other.area;
  }
  double at(const Vec3& p) const { return glm::dot(p, a * p) + 2.0 * glm::dot(b, p) + c; }
};

class Coarsener {
 public:
  Coarsener(TriangleMesh& mesh, const std::vector<float>& values, std::size_t value_count)
      : mesh_(mesh), triangles_(mesh.triangles), value_count_(value_count) {
    points_.assign(mesh.vertices.begin(), mesh.vertices.end());
    values_.assign(values.begin(), values.end());
    around_.resize(points_.size());
    quadrics_.resize(points_.size());
    versions_.assign(points_.size(), 0);
    for (std::uint32_t t = 0; t < triangles_.size(); t += 3) {
      const Quadric plane = plane_of(t);
      for (int k = 0; k < 3; ++k) {
        around_[triangles_[t + k]].push_back(t);
        quadrics_[triangles_[t + k]].add(plane);
      }
    }
    left_ = triangles_.size() / 3;
    for (std::uint32_t v = 0; v < points_.size(); ++v) offer_edges(v, true);
  }

  void run(std::size_t wanted) {
    while (left_ > wanted && !offers_.empty()) {
      const Offer offer = offers_.top();
      offers_.pop();
      if (versions_[offer.a] == offer.version_a && versions_[offer.b] == offer.version_b)
        draw_together(offer.a, offer.b);
    }
    rebuild();
  }

 private:
  struct Offer {
    double cost;
    std::uint32_t a, b, version_a, version_b;
    bool operator<(const Offer& other) const {  // the cheapest is the queue's top
      return std::tie(cost, a, b) > std::tie(other.cost, other.a, other.b);
    }
  };

  Quadric plane_of(std::uint32_t t) const {
    const Vec3 &p = points_[triangles_[t]], &q = points_[triangles_[t + 1]],
               &r = points_[triangles_[t + 2]];
    const Vec3 cross = glm::cross(q - p, r - p);
    const double length = glm::length(cross);
    Quadric plane;
    if (!(length > 0.0)) return plane;
    const Vec3 n = cross / length;
    const double d = -glm::dot(n, p);
    plane.area = 0.5 * length;
    plane.a = glm::outerProduct(n, n) * plane.area;
    plane.b = n * (d * plane.area);
    plane.c = d * d * plane.area;
    return plane;
  }

  std::vector<std::uint32_t> neighbours(std::uint32_t v) const {
    std::vector<std::uint32_t> found;
    for (const std::uint32_t t : around_[v])
      for (int k = 0; k < 3; ++k)
        if (triangles_[t + k] != v) found.push_back(triangles_[t + k]);
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

  /// Where the edge goes to, and the sum there.
  std::pair<Vec3, double> target(std::uint32_t a, std::uint32_t b) const {
    Quadric both = quadrics_[a];
    both.add(quadrics_[b]);
    const Vec3 middle = 0.5 * (points_[a] + points_[b]);
    // Along what is flat the middle is as good as any point.
    constexpr double hold = 1e-3;
    const Mat3 held = both.a + Mat3(hold * both.area);
    const Vec3 p = glm::inverse(held) * (hold * both.area * middle - both.b);
    return {p, std::max(both.at(p), 0.0)};
  }

  void offer_edges(std::uint32_t v, bool greater_only) {
    for (const std::uint32_t n : neighbours(v)) {
      if (greater_only && n < v) continue;
      const auto [a, b] = std::minmax(v, n);
      double cost = target(a, b).second;
      // What the values' squared differences from their means grow by.
      const double share =
          quadrics_[a].area * quadrics_[b].area / (quadrics_[a].area + quadrics_[b].area);
      for (std::size_t k = 0; k < value_count_; ++k) {
        const double d = values_[a * value_count_ + k] - values_[b * value_count_ + k];
        cost += share * d * d;
      }
      offers_.push({cost, a, b, versions_[a], versions_[b]});
    }
  }

  /// Would a triangle around \p v, but for those that \p other is a corner of, turn over with its
  /// corner at \p p?
  bool turns(std::uint32_t v, std::uint32_t other, const Vec3& p) const {
    for (const std::uint32_t t : around_[v]) {
      Vec3 before[3], after[3];
      bool goes = false;
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t corner = triangles_[t + k];
        goes |= corner == other;
        before[k] = points_[corner];
        after[k] = corner == v ? p : before[k];
      }
      if (goes) continue;
      const Vec3 n = glm::cross(before[1] - before[0], before[2] - before[0]);
      const Vec3 m = glm::cross(after[1] - after[0], after[2] - after[0]);
      if (glm::dot(n, m) < 0.5 * glm::length(n) * glm::length(m)) return true;
    }
    return false;
  }

  void draw_together(std::uint32_t a, std::uint32_t b) {
    // A closed surface stays one where the ends have two neighbours in common, which keep three.
    const std::vector<std::uint32_t> of_a = neighbours(a), of_b = neighbours(b);
    std::vector<std::uint32_t> common;
    std::set_intersection(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(),
                          std::back_inserter(common));
    if (common.size() != 2) return;
    for (const std::uint32_t v : common)
      if (around_[v].size() <= 3) return;
    const Vec3 p = target(a, b).first;
    if (turns(a, b, p) || turns(b, a, p)) return;
    const double whole = quadrics_[a].area + quadrics_[b].area;
    for (std::size_t k = 0; k < value_count_; ++k) {
      double& value = values_[a * value_count_ + k];
      value =
          (quadrics_[a].area * value + quadrics_[b].area * values_[b * value_count_ + k]) / whole;
    }
    points_[a] = p;
    quadrics_[a].add(quadrics_[b]);
    for (const std::uint32_t t : around_[b]) {
      std::uint32_t* const corner = &triangles_[t];
      if (std::find(corner, corner + 3, a) == corner + 3) {
        std::replace(corner, corner + 3, b, a);
        around_[a].push_back(t);
        continue;
      }
      for (int k = 0; k < 3; ++k)
        if (corner[k] != b) std::erase(around_[corner[k]], t);
      std::fill(corner, corner + 3, a);
      --left_;
    }
    around_[b].clear();
    ++versions_[b];
    ++versions_[a];
    offer_edges(a, false);
  }

  void rebuild() {
    constexpr auto none = ~std::uint32_t{0};
    std::vector<std::uint32_t> number(points_.size(), none);
    mesh_.vertices.clear();
    for (std::uint32_t v = 0; v < points_.size(); ++v) {
      if (around_[v].empty()) continue;
      number[v] = static_cast<std::uint32_t>(mesh_.vertices.size());
      mesh_.vertices.emplace_back(points_[v]);
    }
    std::vector<std::uint32_t> kept;
    for (std::size_t t = 0; t < triangles_.size(); t += 3) {
      if (triangles_[t] == triangles_[t + 1]) continue;
      for (int k = 0; k < 3; ++k) kept.push_back(number[triangles_[t + k]]);
    }
    mesh_.triangles = std::move(kept);
  }

  TriangleMesh& mesh_;
  std::vector<std::uint32_t> triangles_;
  std::size_t value_count_;
  std::vector<Vec3> points_;
  std::vector<double> values_;
  std::vector<std::vector<std::uint32_t>> around_;  // triangles of each vertex
  std::vector<Quadric> quadrics_;
  std::vector<std::uint32_t> versions_;
  std::priority_queue<Offer> offers_;
  std::size_t left_ = 0;
};

}  // namespace

void coarsen(TriangleMesh& mesh, std::size_t triangles, const std::vector<float>& values,
             std::size_t value_count) {
  Coarsener(mesh, values, value_count).run(triangles);
}

}  // namespace polyhull
