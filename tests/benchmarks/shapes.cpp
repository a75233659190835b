// SPDX-License-Identifier: LGPL-2.1-or-later
#include "benchmarks/shapes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace polyhull::benchmark {
namespace {

constexpr double tau = 2.0 * std::numbers::pi;

double distance_to_segment(const Vec2& p, const Vec2& a, const Vec2& b) {
  const Vec2 d = b - a;
  const double length = glm::dot(d, d);
  const double t = length > 0.0 ? std::clamp(glm::dot(p - a, d) / length, 0.0, 1.0) : 0.0;
  return glm::length(p - a - d * t);
}

Vec2 at(const Shape& s, double phi) {
  const double r = s.radius + s.swing * std::cos(s.points * phi);
  return {s.cx + r * std::cos(phi), s.cy + s.squeeze * r * std::sin(phi)};
}

/// Closed polyline with a grid of buckets, for nearest distances.
class Polyline {
 public:
  explicit Polyline(std::vector<Vec2> points) : points_(std::move(points)) {
    min_ = Vec2(1e30);
    Vec2 max(-1e30);
    for (const Vec2& p : points_) {
      min_ = glm::min(min_, p);
      max = glm::max(max, p);
    }
    columns_ = static_cast<int>((max.x - min_.x) / cell) + 1;
    rows_ = static_cast<int>((max.y - min_.y) / cell) + 1;
    buckets_.resize(static_cast<std::size_t>(columns_) * rows_);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Vec2& a = points_[i];
      const Vec2& b = points_[(i + 1) % points_.size()];
      const int pieces = static_cast<int>(glm::length(b - a) / (cell / 2)) + 1;
      std::size_t last = buckets_.size();
      for (int k = 0; k <= pieces; ++k) {
        const std::size_t bucket = bucket_of(a + (b - a) * (double(k) / pieces));
        if (bucket != last) buckets_[bucket].push_back(static_cast<int>(i));
        last = bucket;
      }
    }
  }

  double distance(const Vec2& p) const {
    const int cx = static_cast<int>((p.x - min_.x) / cell);
    const int cy = static_cast<int>((p.y - min_.y) / cell);
    double best = std::numeric_limits<double>::infinity();
    for (int ring = 0; ring < std::max(columns_, rows_) + std::abs(cx) + std::abs(cy) + 2; ++ring) {
      if (best <= (ring - 1) * cell) break;
      for (int y = cy - ring; y <= cy + ring; ++y) {
        for (int x = cx - ring; x <= cx + ring; ++x) {
          if (std::max(std::abs(x - cx), std::abs(y - cy)) != ring) continue;
          if (x < 0 || y < 0 || x >= columns_ || y >= rows_) continue;
          for (const int i : buckets_[static_cast<std::size_t>(y) * columns_ + x]) {
            best = std::min(best,
                            distance_to_segment(p, points_[i], points_[(i + 1) % points_.size()]));
          }
        }
      }
    }
    return best;
  }

 private:
  static constexpr double cell = 4.0;
  std::size_t bucket_of(const Vec2& p) const {
    const int x = std::clamp(static_cast<int>((p.x - min_.x) / cell), 0, columns_ - 1);
    const int y = std::clamp(static_cast<int>((p.y - min_.y) / cell), 0, rows_ - 1);
    return static_cast<std::size_t>(y) * columns_ + x;
  }
  std::vector<Vec2> points_;
  Vec2 min_;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<std::vector<int>> buckets_;
};

std::vector<Vec2> sampled(std::span<const Vec2f> ring, double step) {
  std::vector<Vec2> samples;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Vec2 a = ring[i];
    const Vec2 d = Vec2(ring[(i + 1) % ring.size()]) - a;
    const int pieces = static_cast<int>(glm::length(d) / step) + 1;
    for (int k = 0; k < pieces; ++k) samples.push_back(a + d * (double(k) / pieces));
  }
  return samples;
}

std::vector<Vec2> doubles(std::span<const Vec2f> ring) {
  return {ring.begin(), ring.end()};
}

}  // namespace

bool Shape::inside(double x, double y) const {
  const double dx = x - cx;
  const double dy = (y - cy) / squeeze;
  const double phi = std::atan2(dy, dx);
  return std::hypot(dx, dy) < radius + swing * std::cos(points * phi);
}

std::vector<Vec2> Shape::boundary(double step) const {
  const double longest = radius + std::abs(swing) * std::max(1, points);
  const int count = static_cast<int>(tau * longest / step) + 8;
  std::vector<Vec2> result;
  result.reserve(count);
  for (int i = 0; i < count; ++i) result.push_back(at(*this, tau * i / count));
  return result;
}

double Shape::distance(double x, double y) const {
  const Vec2 p(x, y);
  double phi = std::atan2((y - cy) / squeeze, x - cx);
  // The nearest point lies within a tooth of the direction; look there, then halve the step.
  double reach = points > 0 ? 0.5 * tau / points : 0.3;
  double best = glm::length(p - at(*this, phi));
  for (int round = 0; round < 18; ++round) {
    const double middle = phi;
    for (int i = -8; i <= 8; ++i) {
      const double d = glm::length(p - at(*this, middle + reach * i / 8.0));
      if (d < best) {
        best = d;
        phi = middle + reach * i / 8.0;
      }
    }
    reach *= 0.35;
  }
  return inside(x, y) ? -best : best;
}

Shape figure_of_17_percent() {
  return {960.3, 540.7, 322.0, 120.0, 24, 1.0};
}

Matte matte_of(const Shape& shape, int width, int height) {
  Matte matte;
  matte.resize(width, height);
  // A pixel further from the boundary than its own diagonal is all inside or all outside.
  std::vector<std::uint8_t> rim(static_cast<std::size_t>(width) * height, 0);
  for (const Vec2& p : shape.boundary(0.5)) {
    for (int y = static_cast<int>(p.y) - 1; y <= static_cast<int>(p.y) + 2; ++y) {
      for (int x = static_cast<int>(p.x) - 1; x <= static_cast<int>(p.x) + 2; ++x) {
        if (x >= 0 && y >= 0 && x < width && y < height) {
          rim[static_cast<std::size_t>(y) * width + x] = 1;
        }
      }
    }
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (rim[static_cast<std::size_t>(y) * width + x] == 0) {
        matte.row(y)[x] = shape.inside(x, y) ? 255 : 0;
        continue;
      }
      int hits = 0;
      for (int j = 0; j < 16; ++j) {
        for (int i = 0; i < 16; ++i) {
          hits += shape.inside(x + (i + 0.5) / 16 - 0.5, y + (j + 0.5) / 16 - 0.5);
        }
      }
      matte.row(y)[x] = static_cast<std::uint8_t>(std::lround(hits * 255.0 / 256.0));
    }
    find_states(matte.row(y), width, matte.state_row(y));
  }
  return matte;
}

ContourError contour_error(const Rings& rings, const Shape& shape) {
  ContourError error;
  std::vector<double> distances;
  std::vector<Vec2> all;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    error.vertices += rings.ring(i).size();
    for (const Vec2& p : sampled(rings.ring(i), 0.25))
      distances.push_back(shape.distance(p.x, p.y));
  }
  if (distances.empty()) return error;
  for (double& d : distances) {
    error.bias += d;
    d = std::abs(d);
    error.mean_absolute += d;
  }
  error.bias /= distances.size();
  error.mean_absolute /= distances.size();
  std::sort(distances.begin(), distances.end());
  error.p999 = distances[static_cast<std::size_t>(0.999 * (distances.size() - 1))];
  error.hausdorff = distances.back();
  // The other way: boundary to contour.
  std::size_t largest = 0;
  for (std::size_t i = 1; i < rings.size(); ++i) {
    if (rings.ring(i).size() > rings.ring(largest).size()) largest = i;
  }
  const Polyline line(doubles(rings.ring(largest)));
  for (const Vec2& p : shape.boundary(1.0)) {
    error.hausdorff = std::max(error.hausdorff, line.distance(p));
  }
  return error;
}

double hausdorff(std::span<const Vec2f> a, std::span<const Vec2f> b, double step) {
  double largest = 0.0;
  const Polyline line_a(doubles(a));
  const Polyline line_b(doubles(b));
  for (const Vec2& p : sampled(a, step)) largest = std::max(largest, line_b.distance(p));
  for (const Vec2& p : sampled(b, step)) largest = std::max(largest, line_a.distance(p));
  return largest;
}

}  // namespace polyhull::benchmark
