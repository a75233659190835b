// SPDX-License-Identifier: LGPL-2.1-or-later
#include "support/figure.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace polyhull::test {
namespace {

/// Distance of the half-line C + s d (s >= 0, |d| = 1) from the segment a b.
double distance(const Vec3& C, const Vec3& d, const Vec3& a, const Vec3& b) {
  const Vec3 e = b - a, w = a - C;
  const double ee = glm::dot(e, e), de = glm::dot(d, e), dw = glm::dot(d, w), ew = glm::dot(e, w);
  const double det = ee - de * de;
  double t = det > 1e-12 * ee ? std::clamp((de * dw - ew) / det, 0.0, 1.0) : 0.0;
  double s = std::max(dw + t * de, 0.0);
  if (ee > 0) t = std::clamp((s * de - ew) / ee, 0.0, 1.0);
  s = std::max(dw + t * de, 0.0);
  return glm::length(w + t * e - s * d);
}

}  // namespace

std::vector<Capsule> walking_figure(double time) {
  const double swing = 0.5 * std::sin(2.0 * time), lift = 0.1 * std::sin(4.0 * time);
  const Vec3 shift(0.05 * std::cos(time), 0.05 * std::sin(0.7 * time), 0.02 * std::sin(4.0 * time));
  const auto p = [&](double x, double y, double z) { return Vec3(x, y, z) + shift; };
  const Vec3 neck = p(0, 0, 0.55), pelvis = p(0, 0, 0.0);
  const Vec3 left_hip = p(-0.14, 0, 0.0), right_hip = p(0.14, 0, 0.0);
  const Vec3 left_knee = p(-0.16, 0.45 * std::sin(swing), -0.45 * std::cos(swing));
  const Vec3 right_knee = p(0.16, -0.45 * std::sin(swing), -0.45 * std::cos(swing));
  const Vec3 left_foot = left_knee + Vec3(-0.02, -0.1 - lift, -0.42);
  const Vec3 right_foot = right_knee + Vec3(0.02, -0.1 + lift, -0.42);
  const Vec3 left_elbow = p(-0.55, 0.05, 0.25), left_hand = p(-0.2, 0.1, 0.05);
  const Vec3 right_elbow = p(0.5, 0.1 * std::sin(time), 0.3 + 0.2 * std::sin(3 * time));
  const Vec3 right_hand =
      right_elbow + Vec3(0.3, 0.1 * std::cos(2 * time), 0.25 * std::sin(3 * time));
  return {{neck, pelvis, 0.19},
          {p(0, 0, 0.82), p(0, 0, 0.86), 0.13},
          {neck, p(0, 0, 0.8), 0.06},
          {p(-0.2, 0, 0.5), left_elbow, 0.065},
          {left_elbow, left_hand, 0.055},
          {p(0.2, 0, 0.5), right_elbow, 0.065},
          {right_elbow, right_hand, 0.055},
          {left_hip, left_knee, 0.095},
          {left_knee, left_foot, 0.075},
          {right_hip, right_knee, 0.095},
          {right_knee, right_foot, 0.075},
          {left_foot, left_foot + Vec3(0, -0.16, -0.03), 0.06},
          {right_foot, right_foot + Vec3(0, -0.16, -0.03), 0.06}};
}

std::vector<Capsule> torus_knot(int pieces) {
  std::vector<Capsule> body;
  const auto at = [&](int i) {
    const double a = 2.0 * M_PI * i / pieces, r = 0.65 + 0.25 * std::cos(3 * a);
    return Vec3(r * std::cos(2 * a), r * std::sin(2 * a), 0.35 * std::sin(3 * a));
  };
  for (int i = 0; i < pieces; ++i) body.push_back({at(i), at(i + 1), 0.12});
  return body;
}

Rings zero_line(const std::function<double(double, double)>& field, double left, double top,
                double step, int columns, int rows) {
  std::vector<double> value(static_cast<std::size_t>(columns) * rows);
  const auto node = [&](int i, int j) -> double& {
    return value[static_cast<std::size_t>(j) * columns + i];
  };
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      double f = field(left + i * step, top + j * step);
      if (i == 0 || j == 0 || i == columns - 1 || j == rows - 1) f = std::max(f, 0.5 * step);
      node(i, j) = f == 0.0 ? 1e-300 : f;
    }
  }
  // Crossing 2k lies between node k and its right neighbour, 2k + 1 between k and the one below.
  constexpr std::uint32_t none = ~0u;
  std::vector<std::uint32_t> next(value.size() * 2, none);
  const auto id = [&](int i, int j, int down) {
    return static_cast<std::uint32_t>((static_cast<std::size_t>(j) * columns + i) * 2 + down);
  };
  for (int j = 0; j + 1 < rows; ++j) {
    for (int i = 0; i + 1 < columns; ++i) {
      // Clockwise as seen on screen; an entry (outside to inside) connects to the next exit, which
      // keeps the silhouette on the left and diagonal neighbours apart.
      const bool in[4] = {node(i, j) < 0, node(i + 1, j) < 0, node(i + 1, j + 1) < 0,
                          node(i, j + 1) < 0};
      const std::uint32_t side[4] = {id(i, j, 0), id(i + 1, j, 1), id(i, j + 1, 0), id(i, j, 1)};
      for (int k = 0; k < 4; ++k) {
        if (in[k] || !in[(k + 1) % 4]) continue;
        int exit = (k + 1) % 4;
        while (!(in[exit] && !in[(exit + 1) % 4])) exit = (exit + 1) % 4;
        next[side[k]] = side[exit];
      }
    }
  }
  Rings rings;
  for (std::uint32_t first = 0; first < next.size(); ++first) {
    if (next[first] == none) continue;
    for (std::uint32_t c = first; next[c] != none;) {
      const auto k = static_cast<int>(c / 2);
      const int i = k % columns, j = k / columns, down = static_cast<int>(c % 2);
      const double a = node(i, j), b = down ? node(i, j + 1) : node(i + 1, j);
      // Away from the nodes, so that snapping cannot make neighbours touch.
      const double s = std::clamp(a / (a - b), 0.15, 0.85);
      const Vec2 p(left + (i + (down ? 0.0 : s)) * step, top + (j + (down ? s : 0.0)) * step);
      rings.points.emplace_back(std::round(p.x * 16) / 16, std::round(p.y * 16) / 16);
      const std::uint32_t after = next[c];
      next[c] = none;
      c = after;
    }
    rings.ends.push_back(static_cast<std::uint32_t>(rings.points.size()));
  }
  return rings;
}

Rings silhouette_of(const std::vector<Capsule>& body, const Camera& camera, double step) {
  const Vec3 C = camera.centre();
  const auto field = [&](double u, double v) {
    const Vec3 d = glm::normalize(camera.ray(Vec2(u, v)));
    double best = std::numeric_limits<double>::infinity();
    for (const Capsule& c : body) best = std::min(best, distance(C, d, c.a, c.b) - c.radius);
    return best;
  };
  const int columns = static_cast<int>(std::ceil(camera.width / step)) + 1;
  const int rows = static_cast<int>(std::ceil(camera.height / step)) + 1;
  return zero_line(field, -0.5, -0.5, step, columns, rows);
}

}  // namespace polyhull::test
