// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/lens.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace polyhull {
namespace {

constexpr double largest_radius = 1000.0;

using Polynomial = std::vector<double>;  // coefficients, constant first

double evaluate(const Polynomial& p, double x) {
  double value = 0.0;
  for (std::size_t i = p.size(); i-- > 0;) value = value * x + p[i];
  return value;
}

Polynomial multiply(const Polynomial& a, const Polynomial& b) {
  Polynomial product(a.size() + b.size() - 1, 0.0);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) product[i + j] += a[i] * b[j];
  return product;
}

Polynomial derivative(const Polynomial& p) {
  Polynomial d;
  for (std::size_t i = 1; i < p.size(); ++i) d.push_back(p[i] * static_cast<double>(i));
  if (d.empty()) d.push_back(0.0);
  return d;
}

// Roots in (0, limit), rising: between neighbouring roots of the derivative there is at most one.
std::vector<double> roots(Polynomial p, double limit) {
  while (p.size() > 1 && p.back() == 0.0) p.pop_back();
  if (p.size() < 2) return {};
  std::vector<double> stops = roots(derivative(p), limit);
  stops.push_back(limit);
  std::vector<double> found;
  double low = 0.0;
  double low_value = evaluate(p, low);
  for (const double high : stops) {
    const double high_value = evaluate(p, high);
    if (high_value == 0.0) {
      if (high < limit) found.push_back(high);
    } else if (low_value * high_value < 0.0) {
      double a = low, b = high;
      for (int i = 0; i < 200 && b - a > 1e-16 * b; ++i) {
        const double middle = 0.5 * (a + b);
        (evaluate(p, middle) * low_value > 0.0 ? a : b) = middle;
      }
      found.push_back(0.5 * (a + b));
    }
    low = high;
    low_value = high_value;
  }
  return found;
}

}  // namespace

Distortion::Distortion(const Camera& camera)
    : fx_(camera.K[0][0]),
      fy_(camera.K[1][1]),
      skew_(camera.K[1][0]),
      cx_(camera.K[2][0]),
      cy_(camera.K[2][1]) {
  const std::size_t count = std::min(camera.distortion.size(), k_.size());
  for (std::size_t i = 0; i < count; ++i) {
    k_[i] = camera.distortion[i];
    active_ = active_ || k_[i] != 0.0;
  }
}

Lens::Lens(const Camera& camera) : Distortion(camera) {
  if (!active_) return;
  // d/dr [r A(s)/B(s)] with s = r^2 has the sign of A B + 2 s (A' B - A B').
  const Polynomial a{1.0, k_[0], k_[1], k_[4]};
  const Polynomial b{1.0, k_[5], k_[6], k_[7]};
  Polynomial slope = multiply(a, b);
  const Polynomial first = multiply(derivative(a), b);
  const Polynomial second = multiply(a, derivative(b));
  for (std::size_t i = 0; i < first.size(); ++i) slope[i + 1] += 2.0 * (first[i] - second[i]);
  const double limit = largest_radius * largest_radius;
  double s = limit;
  for (const Polynomial& p : {slope, b}) {
    const std::vector<double> found = roots(p, limit);
    if (!found.empty()) s = std::min(s, found.front());
  }
  invertible_radius_ = std::sqrt(s);
  if (s < limit) invertible_radius_ *= 1.0 - 1e-9;
  rim_image_ = radial(invertible_radius_);
}

Vec2 Distortion::normalised(const Vec2& pixel) const {
  const double y = (pixel.y - cy_) / fy_;
  return {(pixel.x - cx_ - skew_ * y) / fx_, y};
}

Vec2 Distortion::pixel(const Vec2& p) const {
  return {fx_ * p.x + skew_ * p.y + cx_, fy_ * p.y + cy_};
}

double Distortion::radial(double r) const {
  const double s = r * r;
  return r * (1.0 + s * (k_[0] + s * (k_[1] + s * k_[4]))) /
         (1.0 + s * (k_[5] + s * (k_[6] + s * k_[7])));
}

Vec2 Distortion::bend(const Vec2& p) const {
  const double s = p.x * p.x + p.y * p.y;
  const double q =
      (1.0 + s * (k_[0] + s * (k_[1] + s * k_[4]))) / (1.0 + s * (k_[5] + s * (k_[6] + s * k_[7])));
  const double xy = p.x * p.y;
  return {p.x * q + 2.0 * k_[2] * xy + k_[3] * (s + 2.0 * p.x * p.x) + s * (k_[8] + s * k_[9]),
          p.y * q + k_[2] * (s + 2.0 * p.y * p.y) + 2.0 * k_[3] * xy + s * (k_[10] + s * k_[11])};
}

Vec2 Distortion::distort(const Vec2& ideal) const {
  return active_ ? pixel(bend(normalised(ideal))) : ideal;
}

// The radial map is monotone on the disk: bisection, sharpened by secant steps that stay inside.
double Lens::invert_radial(double target) const {
  if (target >= rim_image_) return invertible_radius_;
  double low = 0.0, high = invertible_radius_;
  double r = std::min(target, 0.5 * high);
  for (int i = 0; i < 200; ++i) {
    const double value = radial(r) - target;
    if (std::abs(value) < 1e-6 * (1.0 + target)) break;
    (value < 0.0 ? low : high) = r;
    const double step = 1e-6 * (1.0 + r);
    const double slope = (radial(r + step) - radial(r)) / step;
    const double next = slope > 0.0 ? r - value / slope : low;
    r = next > low && next < high ? next : 0.5 * (low + high);
  }
  return r;
}

// Newton's method for bend(p) = target from the given start; false where it does not arrive inside
// the disk.
bool Lens::newton(const Vec2& target, Vec2& p) const {
  const double enough = 1e-10 / std::max({std::abs(fx_), std::abs(fy_), 1.0});
  for (int i = 0; i < 30; ++i) {
    const Vec2 error = bend(p) - target;
    const double size = std::max(std::abs(error.x), std::abs(error.y));
    if (!(size < 1e6)) return false;
    const double s = p.x * p.x + p.y * p.y;
    if (size <= enough) return s <= invertible_radius_ * invertible_radius_;
    const double a = 1.0 + s * (k_[0] + s * (k_[1] + s * k_[4]));
    const double b = 1.0 + s * (k_[5] + s * (k_[6] + s * k_[7]));
    const double da = k_[0] + s * (2.0 * k_[1] + s * 3.0 * k_[4]);
    const double db = k_[5] + s * (2.0 * k_[6] + s * 3.0 * k_[7]);
    const double q = a / b;
    const double dq = 2.0 * (da * b - a * db) / (b * b);  // times x or y: the derivative by x or y
    const double thin_x = 2.0 * (k_[8] + 2.0 * s * k_[9]);
    const double thin_y = 2.0 * (k_[10] + 2.0 * s * k_[11]);
    const double xx = q + p.x * p.x * dq + 2.0 * k_[2] * p.y + 6.0 * k_[3] * p.x + thin_x * p.x;
    const double xy = p.x * p.y * dq + 2.0 * k_[2] * p.x + 2.0 * k_[3] * p.y + thin_x * p.y;
    const double yx = p.x * p.y * dq + 2.0 * k_[2] * p.x + 2.0 * k_[3] * p.y + thin_y * p.x;
    const double yy = q + p.y * p.y * dq + 6.0 * k_[2] * p.y + 2.0 * k_[3] * p.x + thin_y * p.y;
    const double determinant = xx * yy - xy * yx;
    if (!(std::abs(determinant) > 1e-12)) return false;
    p -= Vec2(yy * error.x - xy * error.y, xx * error.y - yx * error.x) / determinant;
  }
  // Rounding in bend() can keep the error above `enough` for ever; a millionth of a pixel will do.
  const Vec2 error = bend(p) - target;
  return glm::dot(error, error) <= 1e8 * enough * enough &&
         glm::dot(p, p) <= invertible_radius_ * invertible_radius_;
}

Vec2 Lens::nearest_on_rim(const Vec2& target) const {
  const auto rim = [&](double angle) {
    return invertible_radius_ * Vec2(std::cos(angle), std::sin(angle));
  };
  const auto distance = [&](double angle) {
    const Vec2 difference = bend(rim(angle)) - target;
    return glm::dot(difference, difference);
  };
  const double direction = std::atan2(target.y, target.x);
  double low = direction - 0.5, high = direction + 0.5;
  constexpr double golden = 0.6180339887498949;
  for (int i = 0; i < 60; ++i) {
    const double a = high - golden * (high - low);
    const double b = low + golden * (high - low);
    if (distance(a) < distance(b))
      high = b;
    else
      low = a;
  }
  return rim(0.5 * (low + high));
}

Vec2 Lens::undistort(const Vec2& real) const {
  if (!active_) return real;
  const Vec2 target = normalised(real);
  const double radius = glm::length(target);
  if (radius == 0.0 && k_[2] == 0.0 && k_[3] == 0.0) return real;
  const double start = invert_radial(radius);
  Vec2 p = radius > 0.0 ? target * (start / radius) : target;
  return pixel(newton(target, p) ? p : nearest_on_rim(target));
}

double lost_share(const Camera& camera, int steps) {
  const Lens lens(camera);
  if (!lens.active()) return 0.0;
  int lost = 0;
  for (int i = 0; i <= steps; ++i)
    for (int j = 0; j <= steps; ++j) {
      const Vec2 real((camera.width - 1.0) * i / steps, (camera.height - 1.0) * j / steps);
      lost += !(glm::length(lens.distort(lens.undistort(real)) - real) <= 0.01);
    }
  return lost / static_cast<double>((steps + 1) * (steps + 1));
}

}  // namespace polyhull
