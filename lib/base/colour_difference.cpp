// SPDX-License-Identifier: LGPL-2.1-or-later
#include "base/colour_difference.h"

#include <cmath>
#include <numbers>

namespace polyhull {
namespace {

constexpr double degree = std::numbers::pi / 180.0;

// 0 to 360; 0 where there is no hue.
double hue_of(double a, double b) {
  if (a == 0.0 && b == 0.0) return 0.0;
  const double hue = std::atan2(b, a) / degree;
  return hue < 0.0 ? hue + 360.0 : hue;
}

double compressed(double t) {
  constexpr double d = 6.0 / 29.0;
  return t > d * d * d ? std::cbrt(t) : t / (3.0 * d * d) + 4.0 / 29.0;
}

}  // namespace

Vec3 lab_of_linear(const Vec3& linear) {
  static const Mat3 to_xyz = from_rows({0.4124564, 0.3575761, 0.1804375,  //
                                        0.2126729, 0.7151522, 0.0721750,  //
                                        0.0193339, 0.1191920, 0.9503041});
  // White from the same matrix, so that greys have no hue at all.
  static const Vec3 white = to_xyz * Vec3(1.0);
  const Vec3 xyz = to_xyz * linear / white;
  const Vec3 f(compressed(xyz.x), compressed(xyz.y), compressed(xyz.z));
  return {116.0 * f.y - 16.0, 500.0 * (f.x - f.y), 200.0 * (f.y - f.z)};
}

// The names of the quantities are the paper's.
double colour_difference(const Vec3& a, const Vec3& b) {
  constexpr double pow25_7 = 6103515625.0;
  const double mean_C7 = std::pow((std::hypot(a.y, a.z) + std::hypot(b.y, b.z)) / 2.0, 7.0);
  const double G = 0.5 * (1.0 - std::sqrt(mean_C7 / (mean_C7 + pow25_7)));
  const double a1 = (1.0 + G) * a.y, a2 = (1.0 + G) * b.y;
  const double C1 = std::hypot(a1, a.z), C2 = std::hypot(a2, b.z);
  const double h1 = hue_of(a1, a.z), h2 = hue_of(a2, b.z);
  const bool grey = C1 * C2 == 0.0;

  double dh = grey ? 0.0 : h2 - h1;
  if (dh > 180.0) dh -= 360.0;
  if (dh < -180.0) dh += 360.0;
  const double dL = b.x - a.x, dC = C2 - C1;
  const double dH = 2.0 * std::sqrt(C1 * C2) * std::sin(dh / 2.0 * degree);

  double h = h1 + h2;
  if (!grey) {
    if (std::abs(h1 - h2) > 180.0) h += h < 360.0 ? 360.0 : -360.0;
    h /= 2.0;
  }
  const double L = (a.x + b.x) / 2.0, C = (C1 + C2) / 2.0, C7 = std::pow(C, 7.0);
  const double T = 1.0 - 0.17 * std::cos((h - 30.0) * degree) + 0.24 * std::cos(2.0 * h * degree) +
                   0.32 * std::cos((3.0 * h + 6.0) * degree) -
                   0.20 * std::cos((4.0 * h - 63.0) * degree);
  const double from_blue = (h - 275.0) / 25.0;
  const double R_T = -std::sin(60.0 * std::exp(-from_blue * from_blue) * degree) * 2.0 *
                     std::sqrt(C7 / (C7 + pow25_7));
  const double from_middle = (L - 50.0) * (L - 50.0);
  const double l = dL / (1.0 + 0.015 * from_middle / std::sqrt(20.0 + from_middle));
  const double c = dC / (1.0 + 0.045 * C);
  const double k = dH / (1.0 + 0.015 * C * T);
  return std::sqrt(l * l + c * c + k * k + R_T * c * k);
}

}  // namespace polyhull
