// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The linearised equations of a small rigid motion, for local_motion.h.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "base/vector.h"
#include "texture/colour/positive_system.h"

namespace polyhull {

/// A rigid motion: x becomes turn * x + shift.
struct PartMotion {
  Mat3 turn{1.0};
  Vec3 shift{0.0};
  Vec3 operator()(const Vec3& x) const { return turn * x + shift; }
};

/// The rotation about \p turn by its length, radians.
inline Mat3 turned_by(const Vec3& turn) {
  const double angle = glm::length(turn);
  if (!(angle > 0.0)) return Mat3(1.0);
  const Vec3 k = turn / angle;
  const Mat3 cross(Vec3(0.0, k.z, -k.y), Vec3(-k.z, 0.0, k.x), Vec3(k.y, -k.x, 0.0));
  return Mat3(1.0) + std::sin(angle) * cross + (1.0 - std::cos(angle)) * (cross * cross);
}

/// Huber's weight: 1 up to a residual of 1, falling with it beyond.
inline double huber_weight(double residual) {
  const double size = std::abs(residual);
  return size > 1.0 ? 1.0 / size : 1.0;
}

/// The normal equations of a small motion: turning by x[0..2] about the origin, shifting by x[3..5].
class MotionEquations {
 public:
  /// That \p residual vanishes, which changes as the point at \p arm moves along \p direction.
  void add(const Vec3& arm, const Vec3& direction, double residual, double weight) {
    const Vec3 turn = glm::cross(arm, direction);
    const double row[6] = {turn.x, turn.y, turn.z, direction.x, direction.y, direction.z};
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j <= i; ++j) matrix_[6 * i + j] += weight * row[i] * row[j];
      right_[i] -= weight * row[i] * residual;
    }
  }
  void add(const MotionEquations& other, double weight) {
    for (std::size_t i = 0; i < 36; ++i) matrix_[i] += weight * other.matrix_[i];
    for (std::size_t i = 0; i < 6; ++i) right_[i] += weight * other.right_[i];
  }
  /// That what is around \p centre, out to \p lever, stays, with \p weight.
  void hold(const Vec3& centre, double lever, double weight) {
    for (int i = 0; i < 3; ++i) {
      Vec3 axis(0.0);
      axis[i] = 1.0;
      add(centre, axis, 0.0, weight);
      matrix_[static_cast<std::size_t>(7 * i)] += weight * lever * lever;
    }
  }
  /// \p motion, followed by the solution. Something must be held.
  PartMotion solved(const PartMotion& motion) const {
    std::array<double, 36> matrix = matrix_;
    std::array<double, 6> x = right_;
    solve_positive(matrix, x);
    const Mat3 turn = turned_by({x[0], x[1], x[2]});
    return {turn * motion.turn, turn * motion.shift + Vec3(x[3], x[4], x[5])};
  }

 private:
  std::array<double, 36> matrix_{};  // its lower half
  std::array<double, 6> right_{};
};

}  // namespace polyhull
