// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/calibration/outline_poses.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "base/median.h"
#include "hull/repair/tangency.h"
#include "rig/undistort.h"

namespace polyhull::calibration {
namespace {

/// Outlines are right to about this, px.
constexpr double outline_noise = 0.5;
/// How far cameras are thought to stand from where they should: radians, and parts of their distance
/// from the middle of all.
constexpr double tie_angle = 0.02, tie_place = 0.01;
constexpr int most_rounds = 20;
constexpr std::size_t fewest_tangencies = 18;

/// A turn of the camera as it was given (rotation vector, radians) and its centre.
using Placement = std::array<double, 6>;

/// The pixel's ray in the given camera's axes turned into the world, and how it changes by a pixel.
struct PixelRay {
  Mat3
      to_world;  ///< columns: the ray's change by a pixel to the right, one down, the ray at (0, 0)
  Vec2 pixel;

  template <class T>
  void operator()(const T* placement, T ray[3], T right[3], T down[3]) const {
    const T turn[3] = {placement[0], placement[1], placement[2]};
    const Vec3 at = to_world * Vec3(pixel, 1.0);
    const T unturned[3][3] = {{T(at.x), T(at.y), T(at.z)},
                              {T(to_world[0].x), T(to_world[0].y), T(to_world[0].z)},
                              {T(to_world[1].x), T(to_world[1].y), T(to_world[1].z)}};
    ceres::AngleAxisRotatePoint(turn, unturned[0], ray);
    ceres::AngleAxisRotatePoint(turn, unturned[1], right);
    ceres::AngleAxisRotatePoint(turn, unturned[2], down);
  }
};

template <class T>
T triple(const T a[3], const T b[3], const T c[3]) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
}

struct TangencyResidual {
  PixelRay first, second;

  template <class T>
  bool operator()(const T* a, const T* b, T* residual) const {
    const T e[3] = {b[3] - a[3], b[4] - a[4], b[5] - a[5]};
    T ray_a[3], right_a[3], down_a[3], ray_b[3], right_b[3], down_b[3];
    first(a, ray_a, right_a, down_a);
    second(b, ray_b, right_b, down_b);
    const T changes[4] = {triple(e, right_a, ray_b), triple(e, down_a, ray_b),
                          triple(e, ray_a, right_b), triple(e, ray_a, down_b)};
    T square(0.0);
    for (const T& change : changes) square += change * change;
    if (!(square > T(0.0))) return false;
    residual[0] = std::sqrt(2.0) * triple(e, ray_a, ray_b) / sqrt(square) / outline_noise;
    return true;
  }
};

/// A camera is about where it was.
struct Tie {
  Vec3 centre;
  double place;  ///< world units

  template <class T>
  bool operator()(const T* placement, T* residual) const {
    for (int i = 0; i < 3; ++i) {
      residual[i] = placement[i] / tie_angle;
      residual[3 + i] = (placement[3 + i] - centre[i]) / place;
    }
    return true;
  }
};

Camera placed(const Camera& given, const Placement& placement) {
  Camera camera = given;
  double turn[9];  // column by column
  ceres::AngleAxisToRotationMatrix(placement.data(), turn);
  Mat3 turned;
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) turned[column][row] = turn[3 * column + row];
  camera.R = given.R * glm::transpose(turned);
  camera.t = -(camera.R * Vec3(placement[3], placement[4], placement[5]));
  return camera;
}

/// All instants' tangencies as the cameras stand.
std::vector<Tangency> tangencies_of(const Rig& rig, const std::vector<std::vector<Rings>>& ideal) {
  std::vector<Tangency> all;
  std::vector<Silhouette> silhouettes(rig.cameras.size());
  for (const std::vector<Rings>& instant : ideal) {
    for (std::size_t i = 0; i < silhouettes.size(); ++i)
      silhouettes[i] = {&rig.cameras[i], &instant[i]};
    const std::vector<Tangency> more = find_tangencies(silhouettes);
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

double median_error(const std::vector<Tangency>& tangencies) {
  std::vector<double> errors;
  for (const Tangency& tangency : tangencies) errors.push_back(std::abs(tangency.error));
  return median(std::move(errors));
}

std::vector<double> error_by_camera(const std::vector<Tangency>& tangencies, std::size_t cameras) {
  const std::vector<PairTangency> pairs = median_by_pair(tangencies);
  std::vector<double> errors;
  for (std::size_t i = 0; i < cameras; ++i) errors.push_back(error_with(pairs, i));
  return errors;
}

/// Throws where the free cameras are held by too few points.
void check(const Rig& rig, const std::vector<Tangency>& tangencies,
           const std::vector<std::size_t>& free) {
  for (const std::size_t camera : free) {
    const auto count = static_cast<std::size_t>(
        std::count_if(tangencies.begin(), tangencies.end(), [&](const Tangency& tangency) {
          return tangency.first == camera || tangency.second == camera;
        }));
    if (count < fewest_tangencies)
      throw Error(Error::Kind::bad_input,
                  "Camera '{}' shares {} frontier points with the others, {} are needed: give more "
                  "instants, in which the subject is whole in the pictures and somewhere else.",
                  rig.cameras[camera].name, count, fewest_tangencies);
  }
}

class Adjustment {
 public:
  Adjustment(const Rig& rig, const std::vector<std::size_t>& free)
      : rig_(rig), free_(free), placements_(rig.cameras.size()) {
    Vec3 middle(0.0);
    for (const Camera& camera : rig.cameras)
      middle += camera.centre() / static_cast<double>(rig.cameras.size());
    for (std::size_t i = 0; i < placements_.size(); ++i) {
      const Camera& camera = rig.cameras[i];
      const Vec3 centre = camera.centre();
      placements_[i] = {0.0, 0.0, 0.0, centre.x, centre.y, centre.z};
      ties_.push_back({centre, tie_place * glm::distance(centre, middle)});
      to_world_.push_back(glm::transpose(camera.R) * glm::inverse(camera.K));
    }
  }

  void solve(const std::vector<Tangency>& tangencies) {
    ceres::Problem problem;
    for (const Tangency& t : tangencies)
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<TangencyResidual, 1, 6, 6>(new TangencyResidual{
              {to_world_[t.first], t.at_first}, {to_world_[t.second], t.at_second}}),
          new ceres::HuberLoss(3.0), placements_[t.first].data(), placements_[t.second].data());
    for (std::size_t i = 0; i < placements_.size(); ++i) {
      if (!problem.HasParameterBlock(placements_[i].data())) continue;
      if (std::find(free_.begin(), free_.end(), i) == free_.end())
        problem.SetParameterBlockConstant(placements_[i].data());
      else
        problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Tie, 6, 6>(new Tie(ties_[i])),
                                 new ceres::CauchyLoss(1.0), placements_[i].data());
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
    options.max_num_iterations = 50;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    if (!summary.IsSolutionUsable())
      throw Error(Error::Kind::bad_input, "The poses cannot be estimated: {}.", summary.message);
  }

  Rig rig() const {
    Rig found = rig_;
    for (const std::size_t i : free_) found.cameras[i] = placed(rig_.cameras[i], placements_[i]);
    return found;
  }

 private:
  const Rig& rig_;
  const std::vector<std::size_t>& free_;
  std::vector<Placement> placements_;
  std::vector<Tie> ties_;
  std::vector<Mat3> to_world_;
};

}  // namespace

OutlinePoses poses_from_outlines(const Rig& rig, std::span<const OutlineInstant> instants,
                                 const std::vector<std::size_t>& free) {
  std::vector<std::vector<Rings>> ideal;
  for (const OutlineInstant& instant : instants) {
    ideal.emplace_back();
    for (std::size_t i = 0; i < rig.cameras.size(); ++i)
      ideal.back().push_back(undistort_rings(rig.cameras[i], instant.at(i)).rings);
  }
  OutlinePoses found{rig, 0, 0.0, 0.0, {}, {}};
  std::vector<Tangency> tangencies = tangencies_of(rig, ideal);
  check(rig, tangencies, free);
  found.tangencies = tangencies.size();
  found.error_before = median_error(tangencies);
  found.camera_before = error_by_camera(tangencies, rig.cameras.size());
  Adjustment adjustment(rig, free);
  double last = found.error_before;
  for (int round = 0; round < most_rounds; ++round) {
    adjustment.solve(tangencies);
    found.rig = adjustment.rig();
    tangencies = tangencies_of(found.rig, ideal);
    check(rig, tangencies, free);
    const double now = median_error(tangencies);
    if (round > 1 && std::abs(now - last) < 1e-3 * last) break;
    last = now;
  }
  found.error_after = median_error(tangencies);
  found.camera_after = error_by_camera(tangencies, rig.cameras.size());
  return found;
}

}  // namespace polyhull::calibration
