// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/inverse_distortion.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace polyhull {
namespace {

constexpr std::size_t count = 12;
constexpr int steps = 8;
// Of the mean of the equations' diagonal: keeps what nothing decides near 0.
constexpr double damping = 1e-9;

using Coefficients = std::array<double, count>;  // in OpenCV's order
using Matrix = std::array<Coefficients, count>;

struct Image {
  Vec2 point;
  std::array<Vec2, count> by;  // its derivatives by the coefficients
};

Image image_of(const Coefficients& k, const Vec2& p) {
  const double s = glm::dot(p, p), s2 = s * s, s3 = s2 * s, x = p.x, y = p.y;
  const double below = 1.0 / (1.0 + k[5] * s + k[6] * s2 + k[7] * s3);
  const double radial = (1.0 + k[0] * s + k[1] * s2 + k[4] * s3) * below;
  Image image;
  image.by = {s * below * p,
              s2 * below * p,
              {2.0 * x * y, s + 2.0 * y * y},
              {s + 2.0 * x * x, 2.0 * x * y},
              s3 * below * p,
              -s * below * radial * p,
              -s2 * below * radial * p,
              -s3 * below * radial * p,
              {s, 0.0},
              {s2, 0.0},
              {0.0, s},
              {0.0, s2}};
  image.point = radial * p;
  for (const std::size_t i : {2, 3, 8, 9, 10, 11}) image.point += k[i] * image.by[i];
  return image;
}

// Solves A x = b for a matrix that is symmetric and positive definite, by Cholesky's triangle.
Coefficients solve(Matrix a, Coefficients b) {
  for (std::size_t j = 0; j < count; ++j) {
    for (std::size_t i = j; i < count; ++i) {
      for (std::size_t k = 0; k < j; ++k) a[i][j] -= a[i][k] * a[j][k];
      a[i][j] = i == j ? std::sqrt(a[i][j]) : a[i][j] / a[j][j];
    }
    for (std::size_t k = 0; k < j; ++k) b[j] -= a[j][k] * b[k];
    b[j] /= a[j][j];
  }
  for (std::size_t j = count; j-- > 0;) {
    for (std::size_t i = j + 1; i < count; ++i) b[j] -= a[i][j] * b[i];
    b[j] /= a[j][j];
  }
  return b;
}

Coefficients improved(const Coefficients& k, const std::vector<DistortedPoint>& points) {
  Matrix normal{};
  Coefficients right{};
  for (const DistortedPoint& point : points) {
    const Image image = image_of(k, point.ideal);
    const Vec2 missing = point.real - image.point;
    for (std::size_t i = 0; i < count; ++i) {
      right[i] += glm::dot(image.by[i], missing);
      for (std::size_t j = 0; j <= i; ++j) normal[i][j] += glm::dot(image.by[i], image.by[j]);
    }
  }
  double mean = 0.0;
  for (std::size_t i = 0; i < count; ++i) mean += normal[i][i] / count;
  for (std::size_t i = 0; i < count; ++i) normal[i][i] += damping * mean;
  Coefficients result = solve(normal, right);
  for (std::size_t i = 0; i < count; ++i) result[i] += k[i];
  return result;
}

// The coefficients for coordinates that are \p scale times smaller.
std::vector<double> rescaled(const Coefficients& k, double scale) {
  constexpr std::array<int, count> power{2, 4, 1, 1, 6, 2, 4, 6, 1, 3, 1, 3};
  std::vector<double> result;
  for (std::size_t i = 0; i < count; ++i) result.push_back(k[i] * std::pow(scale, power[i]));
  return result;
}

}  // namespace

std::optional<std::vector<double>> fit_distortion(const std::vector<DistortedPoint>& points,
                                                  double tolerance) {
  double reach = 0.0;
  for (const DistortedPoint& point : points) {
    if (!std::isfinite(point.ideal.x + point.ideal.y)) return {};
    reach = std::max(reach, glm::length(point.ideal));
  }
  if (!(reach > 0.0) || !std::isfinite(reach)) return {};
  // Powers of up to 6 are comparable where the furthest point is at 1.
  std::vector<DistortedPoint> scaled = points;
  for (DistortedPoint& point : scaled) point.ideal /= reach, point.real /= reach;
  Coefficients k{};
  for (int i = 0; i < steps; ++i) k = improved(k, scaled);
  for (const DistortedPoint& point : scaled)
    if (!(glm::length(image_of(k, point.ideal).point - point.real) * reach <= tolerance)) return {};
  return rescaled(k, 1.0 / reach);
}

}  // namespace polyhull
