// SPDX-License-Identifier: LGPL-2.1-or-later
#include <ceres/covariance.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "studio/calibration/adjust_internal.h"

namespace polyhull::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

Matrix3d eigen_of(const Mat3& m) {
  Matrix3d out;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) out(r, c) = m[c][r];
  return out;
}

Mat3 glm_of(const Matrix3d& m) {
  Mat3 out;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) out[c][r] = m(r, c);
  return out;
}

Matrix3d cross_matrix(const Vector3d& v) {
  Matrix3d out;
  out << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return out;
}

// How exp([a + da]) turns against exp([a]), to first order (J. Sola et al., "A micro Lie theory",
// 2018, eq. 145).
Matrix3d left_jacobian(const Vector3d& a) {
  const double angle = a.norm();
  const Matrix3d A = cross_matrix(a);
  if (angle < 1e-6) return Matrix3d::Identity() + 0.5 * A;
  return Matrix3d::Identity() + (1.0 - std::cos(angle)) / (angle * angle) * A +
         (angle - std::sin(angle)) / (angle * angle * angle) * A * A;
}

// From changes of a pose's parameters to those of the centre and of the axes, both in the world.
MatrixXd motion_of(const std::array<double, pose_parameters>& parameters) {
  const Pose pose = from_parameters(parameters.data());
  const Matrix3d back = eigen_of(pose.R).transpose();
  const Matrix3d turn = left_jacobian(Vector3d(parameters[0], parameters[1], parameters[2]));
  const Vector3d t(pose.t.x, pose.t.y, pose.t.z);
  MatrixXd out = MatrixXd::Zero(6, 6);
  // centre = -R' t, and R becomes exp([w]) R: -R' (dt - w x t).
  out.block<3, 3>(0, 0) = -back * cross_matrix(t) * turn;
  out.block<3, 3>(0, 3) = -back;
  out.block<3, 3>(3, 0) = -back * turn;
  return out;
}

// Takes out of all cameras' changes what moves the rig as a whole, so that centres (m) and axes
// (radians times the rig's radius) change least.
MatrixXd own_part(const Unknowns& unknowns) {
  const auto n = static_cast<Eigen::Index>(unknowns.cameras.size());
  std::vector<Vector3d> centres;
  Vector3d middle = Vector3d::Zero();
  for (const auto& parameters : unknowns.cameras) {
    const Pose pose = from_parameters(parameters.data());
    const Vec3 c = -(glm::transpose(pose.R) * pose.t);
    centres.emplace_back(c.x, c.y, c.z);
    middle += centres.back() / static_cast<double>(n);
  }
  double radius = 0.0;
  for (const Vector3d& c : centres) radius += (c - middle).norm() / static_cast<double>(n);
  MatrixXd whole = MatrixXd::Zero(6 * n, 6);
  Eigen::VectorXd weight(6 * n);
  for (Eigen::Index c = 0; c < n; ++c) {
    whole.block<3, 3>(6 * c, 0) = Matrix3d::Identity();
    whole.block<3, 3>(6 * c, 3) = -cross_matrix(centres[c] - middle);
    whole.block<3, 3>(6 * c + 3, 3) = Matrix3d::Identity();
    weight.segment<3>(6 * c).setOnes();
    weight.segment<3>(6 * c + 3).setConstant(std::max(1e-12, radius * radius));
  }
  const MatrixXd weighted = whole.transpose() * weight.asDiagonal();
  return MatrixXd::Identity(6 * n, 6 * n) - whole * (weighted * whole).ldlt().solve(weighted);
}

Uncertainty unknown_uncertainty() {
  Uncertainty out;
  constexpr double infinite = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) out.centre[i][i] = out.rotation[i][i] = infinite;
  out.lens.fill(infinite);
  return out;
}

using Block = const double*;

// The unknown poses' covariance, all cameras' together; 0 for the one that is held.
MatrixXd pose_covariance(const ceres::Covariance& covariance, const Unknowns& unknowns,
                         std::size_t first) {
  const std::size_t n = unknowns.cameras.size();
  MatrixXd out = MatrixXd::Zero(static_cast<Eigen::Index>(6 * n), static_cast<Eigen::Index>(6 * n));
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = 0; b < n; ++b) {
      if (a == first || b == first) continue;
      Eigen::Matrix<double, 6, 6, Eigen::RowMajor> block;
      covariance.GetCovarianceBlock(unknowns.cameras[a].data(), unknowns.cameras[b].data(),
                                    block.data());
      out.block<6, 6>(static_cast<Eigen::Index>(6 * a), static_cast<Eigen::Index>(6 * b)) = block;
    }
  }
  return out;
}

}  // namespace

std::vector<Uncertainty> find_uncertainties(const Take& take, ceres::Problem& problem,
                                            const Unknowns& unknowns, std::size_t first) {
  const std::size_t n = unknowns.cameras.size();
  std::vector<std::pair<Block, Block>> blocks;
  for (std::size_t a = 0; a < n; ++a) {
    if (!take.cameras[a].known)
      blocks.emplace_back(unknowns.lenses[a].data(), unknowns.lenses[a].data());
    for (std::size_t b = a; b < n; ++b)
      if (a != first && b != first)
        blocks.emplace_back(unknowns.cameras[a].data(), unknowns.cameras[b].data());
  }
  std::vector<Uncertainty> out(n);
  if (blocks.empty()) return out;
  ceres::Covariance::Options options;
  options.algorithm_type = ceres::SPARSE_QR;
  options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  ceres::Covariance covariance(options);
  if (!covariance.Compute(blocks, &problem))
    return std::vector<Uncertainty>(n, unknown_uncertainty());

  MatrixXd motions =
      MatrixXd::Zero(static_cast<Eigen::Index>(6 * n), static_cast<Eigen::Index>(6 * n));
  for (std::size_t c = 0; c < n; ++c)
    motions.block<6, 6>(static_cast<Eigen::Index>(6 * c), static_cast<Eigen::Index>(6 * c)) =
        motion_of(unknowns.cameras[c]);
  const MatrixXd own = own_part(unknowns) * motions;
  const MatrixXd poses = own * pose_covariance(covariance, unknowns, first) * own.transpose();
  for (std::size_t c = 0; c < n; ++c) {
    const auto at = static_cast<Eigen::Index>(6 * c);
    out[c].centre = glm_of(poses.block<3, 3>(at, at));
    out[c].rotation = glm_of(poses.block<3, 3>(at + 3, at + 3));
    if (take.cameras[c].known) continue;
    std::array<double, lens_parameters * lens_parameters> lens{};
    covariance.GetCovarianceBlock(unknowns.lenses[c].data(), unknowns.lenses[c].data(),
                                  lens.data());
    for (int i = 0; i < lens_parameters; ++i)
      out[c].lens[i] = std::sqrt(std::max(0.0, lens[i * lens_parameters + i]));
  }
  return out;
}

}  // namespace polyhull::calibration
