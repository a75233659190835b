// SPDX-License-Identifier: LGPL-2.1-or-later
#include "support/membership.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

namespace polyhull::test {
namespace {

template <class Real>
constexpr Real rounding = Real(16) * std::numeric_limits<Real>::epsilon();

/// Sign of value, 0 when it is below error.
template <class Real>
int certain_sign(Real value, Real error) {
  return value > error ? 1 : value < -error ? -1 : 0;
}

}  // namespace

SilhouetteMembership::Region SilhouetteMembership::index(const Rings& rings) {
  Region region;
  if (rings.points.empty()) return region;
  double top = rings.points[0].y, bottom = top;
  for (const Vec2f& p : rings.points) {
    top = std::min<double>(top, p.y);
    bottom = std::max<double>(bottom, p.y);
  }
  region.bands = static_cast<std::uint32_t>(std::clamp<std::size_t>(rings.points.size(), 1, 1024));
  region.top = top;
  region.per_band = region.bands / std::max((bottom - top) * (1 + 1e-9), 1e-300);
  const auto for_each = [&](auto&& take) {
    for (std::size_t r = 0; r < rings.size(); ++r) {
      const auto ring = rings.ring(r);
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const Vec2f p = ring[i], q = ring[i + 1 == ring.size() ? 0 : i + 1];
        if (p.y == q.y) continue;  // the half-open rule never meets it
        const auto band = [&](double v) {
          return static_cast<std::uint32_t>(
              std::clamp((v - top) * region.per_band, 0.0, region.bands - 1.0));
        };
        for (std::uint32_t b = band(std::min(p.y, q.y)); b <= band(std::max(p.y, q.y)); ++b) {
          take(b, Edge{p.x, p.y, q.x, q.y});
        }
      }
    }
  };
  region.start.assign(region.bands + 1, 0);
  for_each([&](std::uint32_t band, const Edge&) { ++region.start[band + 1]; });
  for (std::uint32_t b = 0; b < region.bands; ++b) region.start[b + 1] += region.start[b];
  region.edges.resize(region.start.back());
  std::vector<std::uint32_t> fill(region.start.begin(), region.start.end() - 1);
  for_each([&](std::uint32_t band, const Edge& edge) { region.edges[fill[band]++] = edge; });
  return region;
}

SilhouetteMembership::SilhouetteMembership(std::span<const Silhouette> silhouettes,
                                           const HullOptions& options)
    : bounds_(options.bounds), keep_unseen_(options.unseen == Unseen::keep) {
  for (const Silhouette& s : silhouettes) {
    const Mat3 KR = s.camera->K * s.camera->R;
    views_.push_back({KR, s.camera->K * s.camera->t, s.camera, index(*s.rings)});
  }
}

template <class Real>
SilhouetteMembership::Answer SilhouetteMembership::place(const View& view, const Vec3& X,
                                                         bool keep_unseen) {
  const Camera& camera = *view.camera;
  // Camera coordinates, then homogeneous pixels, each with a bound on its rounding error.
  Real x[3], error[3];
  for (int row = 0; row < 3; ++row) {
    Real sum = camera.t[row], size = std::abs(sum);
    for (int column = 0; column < 3; ++column) {
      const Real term = Real(camera.R[column][row]) * Real(X[column]);
      sum += term;
      size += std::abs(term);
    }
    x[row] = sum;
    error[row] = rounding<Real> * size;
  }
  Real h[3], bound[3];
  for (int row = 0; row < 3; ++row) {
    h[row] = 0;
    bound[row] = 0;
    for (int column = 0; column < 3; ++column) {
      const Real k = camera.K[column][row];
      h[row] += k * x[column];
      bound[row] += std::abs(k) * (error[column] + rounding<Real> * std::abs(x[column]));
    }
  }
  const int front = certain_sign(h[2], bound[2]);
  if (front == 0) return undecided;
  if (front < 0) return keep_unseen ? inside : outside;
  const auto compare = [&](int axis, Real value) {  // sign of pixel coordinate - value
    return certain_sign(h[axis] - value * h[2], bound[axis] + std::abs(value) * bound[2] +
                                                    rounding<Real> * std::abs(h[axis]));
  };
  if (keep_unseen) {
    const int left = compare(0, Real(-0.5)), right = compare(0, Real(camera.width) - Real(0.5));
    const int top = compare(1, Real(-0.5)), bottom = compare(1, Real(camera.height) - Real(0.5));
    if (left < 0 || right > 0 || top < 0 || bottom > 0) return inside;
    if (left == 0 || right == 0 || top == 0 || bottom == 0) return undecided;
  }
  const Region& region = view.region;
  if (region.bands == 0) return outside;
  const double v = static_cast<double>(h[1] / h[2]);
  const double band = (v - region.top) * region.per_band;
  if (!(band >= -1e-6 && band <= region.bands + 1e-6)) return outside;
  const auto b = static_cast<std::uint32_t>(std::clamp(band, 0.0, region.bands - 1.0));
  bool in = false;
  for (std::uint32_t i = region.start[b]; i < region.start[b + 1]; ++i) {
    const Edge& edge = region.edges[i];
    const int s0 = compare(1, Real(edge.v0)), s1 = compare(1, Real(edge.v1));
    if (s0 == 0 || s1 == 0) return undecided;
    if (s0 == s1) continue;
    // Side of the edge: (q - p) x (pixel - p), times z.
    const Real du = Real(edge.u1) - Real(edge.u0), dv = Real(edge.v1) - Real(edge.v0);
    const Real a = h[0] - Real(edge.u0) * h[2], c = h[1] - Real(edge.v0) * h[2];
    const Real side = du * c - dv * a;
    const Real side_error =
        std::abs(du) * (bound[1] + std::abs(Real(edge.v0)) * bound[2]) +
        std::abs(dv) * (bound[0] + std::abs(Real(edge.u0)) * bound[2]) +
        rounding<Real> * (std::abs(du) * (std::abs(h[1]) + std::abs(Real(edge.v0) * h[2])) +
                          std::abs(dv) * (std::abs(h[0]) + std::abs(Real(edge.u0) * h[2])));
    const int sign = certain_sign(side, side_error);
    if (sign == 0) return undecided;
    // The pixel is left of a downward edge when the cross product is positive.
    if ((sign > 0) == (dv > 0)) in = !in;
  }
  return in ? inside : outside;
}

SilhouetteMembership::Answer SilhouetteMembership::ask(const Vec3& X) const {
  if (bounds_) {
    for (int k = 0; k < 3; ++k) {
      if (X[k] < bounds_->min[k] || X[k] > bounds_->max[k]) return outside;
    }
  }
  bool unsure = false;
  for (const View& view : views_) {
    Answer answer = place<double>(view, X, keep_unseen_);
    if (answer == undecided) answer = place<long double>(view, X, keep_unseen_);
    if (answer == outside) return outside;
    unsure |= answer == undecided;
  }
  return unsure ? undecided : inside;
}

std::vector<SilhouetteMembership::Answer> SilhouetteMembership::ask(
    std::span<const Vec3> points) const {
  std::vector<Answer> answers(points.size(), outside);
  constexpr std::size_t block = 1024;
  std::array<double, block> u, v, z;
  std::vector<std::uint32_t> left;
  for (std::size_t begin = 0; begin < points.size(); begin += block) {
    const std::size_t count = std::min(block, points.size() - begin);
    left.resize(count);
    for (std::size_t i = 0; i < count; ++i) left[i] = static_cast<std::uint32_t>(i);
    // A quick pass in plain doubles drops points that are far outside of some silhouette's rows.
    if (!keep_unseen_) {
      for (const View& view : views_) {
        const std::size_t n = left.size();
        const Mat3& M = view.KR;
        for (std::size_t k = 0; k < n; ++k) {
          const Vec3& X = points[begin + left[k]];
          z[k] = M[0][2] * X.x + M[1][2] * X.y + M[2][2] * X.z + view.Kt.z;
          u[k] = M[0][0] * X.x + M[1][0] * X.y + M[2][0] * X.z + view.Kt.x;
          v[k] = M[0][1] * X.x + M[1][1] * X.y + M[2][1] * X.z + view.Kt.y;
        }
        std::size_t stay = 0;
        const double bottom = view.region.bands / std::max(view.region.per_band, 1e-300);
        for (std::size_t k = 0; k < n; ++k) {
          const double row = v[k] / z[k] - view.region.top;
          const bool far_outside =
              z[k] > 0 && view.region.bands > 0 && (row < -1.0 || row > bottom + 1.0);
          left[stay] = left[k];
          stay += !far_outside;
        }
        left.resize(stay);
      }
    }
    for (std::uint32_t i : left) answers[begin + i] = ask(points[begin + i]);
  }
  return answers;
}

MeshMembership::MeshMembership(const Hull& hull) : hull_(hull) {
  if (hull.triangles.empty()) return;
  Vec2 low(hull.vertices[0]), high = low;
  for (const Vec3f& v : hull.vertices) {
    low = glm::min(low, Vec2(v));
    high = glm::max(high, Vec2(v));
  }
  columns_ =
      std::clamp(static_cast<int>(std::sqrt(double(hull.triangles.size()) / 3) * 2), 8, 1024);
  corner_ = low;
  per_cell_ = double(columns_) / glm::max((high - low) * (1 + 1e-9), Vec2(1e-300));
  const auto cell = [&](double x, int axis) {
    return std::clamp(static_cast<int>((x - corner_[axis]) * per_cell_[axis]), 0, columns_ - 1);
  };
  const auto for_each = [&](auto&& take) {
    for (std::uint32_t t = 0; t < hull.triangles.size() / 3; ++t) {
      Vec2 lo(hull.vertices[hull.triangles[t * 3]]), hi = lo;
      for (int k = 1; k < 3; ++k) {
        const Vec2 p(hull.vertices[hull.triangles[t * 3 + k]]);
        lo = glm::min(lo, p);
        hi = glm::max(hi, p);
      }
      for (int y = cell(lo.y, 1); y <= cell(hi.y, 1); ++y) {
        for (int x = cell(lo.x, 0); x <= cell(hi.x, 0); ++x) {
          take(static_cast<std::size_t>(y) * columns_ + x, t);
        }
      }
    }
  };
  start_.assign(static_cast<std::size_t>(columns_) * columns_ + 1, 0);
  for_each([&](std::size_t c, std::uint32_t) { ++start_[c + 1]; });
  for (std::size_t c = 0; c + 1 < start_.size(); ++c) start_[c + 1] += start_[c];
  triangles_.resize(start_.back());
  std::vector<std::uint32_t> fill(start_.begin(), start_.end() - 1);
  for_each([&](std::size_t c, std::uint32_t t) { triangles_[fill[c]++] = t; });
}

int MeshMembership::winding(const Vec3& X) const {
  if (columns_ == 0) return 0;
  const Vec3 p = X - hull_.origin;
  const Vec2 at = (Vec2(p) - corner_) * per_cell_;
  if (!(at.x >= 0 && at.y >= 0 && at.x < columns_ && at.y < columns_)) return 0;
  const std::size_t cell =
      static_cast<std::size_t>(at.y) * columns_ + static_cast<std::size_t>(at.x);
  using Real = long double;  // 64 bits hold these products of float differences with the point's
  const auto side = [&](const Vec3f& a, const Vec3f& b) {
    const double bx = double(b.x) - a.x, by = double(b.y) - a.y, px = p.x - a.x, py = p.y - a.y;
    const double left = bx * py, right = by * px, value = left - right;
    if (std::abs(value) > 1e-15 * (std::abs(left) + std::abs(right))) return value > 0 ? 1 : -1;
    const Real exact = Real(bx) * (Real(p.y) - a.y) - Real(by) * (Real(p.x) - a.x);
    if (exact != 0) return exact > 0 ? 1 : -1;
    if (by != 0) return by < 0 ? 1 : -1;
    return bx > 0 ? 1 : bx < 0 ? -1 : 0;
  };
  int winding = 0;
  for (std::uint32_t i = start_[cell]; i < start_[cell + 1]; ++i) {
    const std::uint32_t* t = &hull_.triangles[std::size_t(triangles_[i]) * 3];
    const Vec3f &a = hull_.vertices[t[0]], &b = hull_.vertices[t[1]], &c = hull_.vertices[t[2]];
    const int s = side(a, b);
    if (s == 0 || side(b, c) != s || side(c, a) != s) continue;
    const auto weight = [&](const Vec3f& q, const Vec3f& r) {
      return (Real(q.x) - p.x) * (Real(r.y) - p.y) - (Real(q.y) - p.y) * (Real(r.x) - p.x);
    };
    const Real wa = weight(b, c), wb = weight(c, a), wc = weight(a, b);
    const Real above = wa * (Real(a.z) - p.z) + wb * (Real(b.z) - p.z) + wc * (Real(c.z) - p.z);
    if ((above > 0) == (s > 0) && above != 0) winding += s;
  }
  return winding;
}

MembershipReport compare_membership(const Hull& hull, std::span<const Silhouette> silhouettes,
                                    const HullOptions& options, const Bounds& box,
                                    std::size_t count, std::uint64_t seed) {
  const SilhouetteMembership truth(silhouettes, options);
  const MeshMembership mesh(hull);
  std::mt19937_64 random(seed);
  const auto unit = [&] { return double(random() >> 11) * 0x1p-53; };
  MembershipReport report;
  report.points = count;
  std::vector<Vec3> points;
  while (count > 0) {
    points.resize(std::min<std::size_t>(count, 65536));
    count -= points.size();
    for (Vec3& X : points) {
      const double a = unit(), b = unit(), c = unit();
      X = box.min + (box.max - box.min) * Vec3(a, b, c);
    }
    const auto answers = truth.ask(points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      report.inside += answers[i] == SilhouetteMembership::inside;
      if (answers[i] == SilhouetteMembership::undecided) {
        ++report.undecided;
        continue;
      }
      const int winding = mesh.winding(points[i]);
      const bool in = answers[i] == SilhouetteMembership::inside;
      if (winding == int(in)) continue;
      if (winding != 0 && winding != 1) {
        ++report.bad_winding;
      } else if (in) {
        ++report.missing;
      } else {
        ++report.extra;
      }
      if (report.wrong() > 100) continue;  // the distance is for looking into, and slow
      const double distance = distance_to_surface(hull, points[i]);
      if (distance >= report.worst_distance) {
        report.worst_distance = distance;
        report.worst = points[i];
      }
    }
  }
  const Vec3 size = box.max - box.min;
  report.volume = size.x * size.y * size.z * double(report.inside) / double(report.points);
  return report;
}

Bounds box_of(const Hull& hull, double margin) {
  if (hull.vertices.empty()) return {hull.origin, hull.origin};
  Vec3 low(hull.vertices[0]), high = low;
  for (const Vec3f& v : hull.vertices) {
    low = glm::min(low, Vec3(v));
    high = glm::max(high, Vec3(v));
  }
  const Vec3 extra = (high - low) * margin;
  return {hull.origin + low - extra, hull.origin + high + extra};
}

Bounds join(const Bounds& a, const Bounds& b) {
  return {glm::min(a.min, b.min), glm::max(a.max, b.max)};
}

double distance_to_surface(const Hull& hull, const Vec3& X) {
  const Vec3 p = X - hull.origin;
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t t = 0; t < hull.triangles.size(); t += 3) {
    const Vec3 a(hull.vertices[hull.triangles[t]]), b(hull.vertices[hull.triangles[t + 1]]),
        c(hull.vertices[hull.triangles[t + 2]]);
    const Vec3 n = glm::cross(b - a, c - a);
    const double n2 = glm::dot(n, n);
    bool over = n2 > 0;
    const Vec3 corners[3] = {a, b, c};
    for (int k = 0; k < 3; ++k) {
      const Vec3 &q = corners[k], &r = corners[(k + 1) % 3];
      const Vec3 d = r - q;
      const double length2 = glm::dot(d, d);
      const double s = length2 > 0 ? std::clamp(glm::dot(p - q, d) / length2, 0.0, 1.0) : 0.0;
      best = std::min(best, glm::length(p - q - s * d));
      over = over && glm::dot(glm::cross(d, p - q), n) >= 0;
    }
    if (over) best = std::min(best, std::abs(glm::dot(p - a, n)) / std::sqrt(n2));
  }
  return best;
}

}  // namespace polyhull::test
