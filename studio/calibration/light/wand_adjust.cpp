// SPDX-License-Identifier: LGPL-2.1-or-later
#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/median.h"
#include "studio/calibration/adjust_internal.h"
#include "studio/calibration/light/wand.h"

namespace polyhull::calibration {
namespace {

constexpr double huber = 2.0;
constexpr int rounds = 5;
// How sure the known distance is where one pixel is the noise, m.
constexpr double distance_sigma = 1e-4;

struct PointsApart {
  double metres;
  template <class T>
  bool operator()(const T* a, const T* b, T* residual) const {
    T d[3];
    for (int i = 0; i < 3; ++i) d[i] = a[3 + i] - b[3 + i];
    residual[0] = (ceres::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) - metres) / distance_sigma;
    return true;
  }
};

// A camera's centre is -R't.
struct CamerasApart {
  double metres;
  template <class T>
  bool operator()(const T* a, const T* b, T* residual) const {
    T p[3], q[3];
    const T back_a[3] = {-a[0], -a[1], -a[2]}, back_b[3] = {-b[0], -b[1], -b[2]};
    ceres::AngleAxisRotatePoint(back_a, a + 3, p);
    ceres::AngleAxisRotatePoint(back_b, b + 3, q);
    const T d[3] = {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
    residual[0] = (ceres::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) - metres) / distance_sigma;
    return true;
  }
};

class PointAdjuster {
 public:
  PointAdjuster(const Take& take, const std::vector<Camera>& lenses, const Placement& placement,
                const WandSettings& settings)
      : take_(take), cameras_(lenses), settings_(settings), first_(placement.first) {
    for (std::size_t c = 0; c < lenses.size(); ++c) {
      cameras_[c].R = placement.cameras[c].R;
      cameras_[c].t = placement.cameras[c].t;
    }
  }

  Adjusted run() {
    const bool all_known = std::ranges::all_of(
        take_.cameras, [](const auto& camera) { return camera.known.has_value(); });
    double limit = all_known ? 10.0 : 30.0;
    for (int round = 0; round < rounds; ++round) {
      settings_.progress("adjusting all cameras", static_cast<double>(round) / rounds);
      select(limit);
      if (round == 0) scale();
      solve(true, round);
      const double sigma = measure() / 1.177;
      limit = std::clamp(5.0 * sigma, 0.05, limit);
    }
    select(limit);
    solve(false, rounds);
    measure();
    settings_.progress("adjusting all cameras", 1.0);
    return result();
  }

 private:
  void select(double limit) {
    points_ = triangulate_points(take_, cameras_, std::vector<bool>(cameras_.size(), true), limit,
                                 &used_);
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      std::size_t count = 0;
      for (std::size_t v = 0; v < used_.size(); ++v)
        count += used_[v] && take_.views[v].camera == c;
      if (count < least_points / 2)
        throw Error(Error::Kind::bad_input,
                    "Only {} points of camera '{}' agree with those of the other cameras; was it "
                    "moved, or are its pictures of other instants?",
                    count, take_.cameras[c].name);
    }
  }

  bool seen(std::size_t instant) const {
    for (std::size_t v = 0; v < used_.size(); ++v)
      if (used_[v] && take_.views[v].instant == instant) return true;
    return false;
  }

  void scale() {
    const KnownDistance& known = settings_.distance;
    std::vector<double> lengths;
    for (const auto& [a, b] : known.instants)
      if (seen(a) && seen(b)) lengths.push_back(glm::length(points_[a] - points_[b]));
    if (known.cameras)
      lengths.push_back(glm::length(cameras_[(*known.cameras)[0]].centre() -
                                    cameras_[(*known.cameras)[1]].centre()));
    const double length = median(lengths);
    if (!(length > 0.0))
      throw Error(Error::Kind::bad_input,
                  "Both points of the known distance were seen by two cameras that agree at no "
                  "instant; so it is not known how large the world is.");
    for (Camera& camera : cameras_) camera.t *= known.metres / length;
    for (Vec3& point : points_) point *= known.metres / length;
  }

  void take_parameters() {
    unknowns_ = {};
    for (const Camera& camera : cameras_) {
      auto& lens = unknowns_.lenses.emplace_back();
      lens = {camera.K[0][0], camera.K[1][1], camera.K[2][0], camera.K[2][1]};
      for (std::size_t i = 0; i < 5 && i < camera.distortion.size(); ++i)
        lens[4 + i] = camera.distortion[i];
      unknowns_.cameras.push_back(to_parameters({camera.R, camera.t}));
    }
    for (const Vec3& point : points_)
      unknowns_.boards.push_back({0.0, 0.0, 0.0, point.x, point.y, point.z});
  }

  void add_views(ceres::Problem& problem, ceres::LossFunction* loss) {
    for (std::size_t v = 0; v < used_.size(); ++v) {
      if (!used_[v]) continue;
      const View& view = take_.views[v];
      double* camera = unknowns_.cameras[view.camera].data();
      double* point = unknowns_.boards[view.instant].data();
      if (const auto& known = take_.cameras[view.camera].known) {
        std::array<double, 12> k{};
        std::ranges::copy(known->distortion, k.begin());
        using Function = ceres::AutoDiffCostFunction<KnownLensResidual, 2, 6, 6>;
        problem.AddResidualBlock(
            new Function(new KnownLensResidual{Vec3(0.0), view.corners[0], known->K, k}), loss,
            camera, point);
      } else {
        using Function = ceres::AutoDiffCostFunction<CornerResidual, 2, 9, 6, 6>;
        problem.AddResidualBlock(new Function(new CornerResidual{Vec3(0.0), view.corners[0]}), loss,
                                 unknowns_.lenses[view.camera].data(), camera, point);
      }
    }
  }

  // The first round finds focal lengths only: mismatches would bend the lens.
  void hold(ceres::Problem& problem, int round) {
    problem.SetParameterBlockConstant(unknowns_.cameras[first_].data());
    for (auto& point : unknowns_.boards)
      if (problem.HasParameterBlock(point.data()))
        problem.SetManifold(point.data(), new ceres::SubsetManifold(6, {0, 1, 2}));
    std::vector<int> held;
    if (settings_.model == LensModel::four) held = {8};
    if (settings_.model == LensModel::pinhole) held = {4, 5, 6, 7, 8};
    if (round == 0) held = {2, 3, 4, 5, 6, 7, 8};
    for (auto& lens : unknowns_.lenses)
      if (!held.empty() && problem.HasParameterBlock(lens.data()))
        problem.SetManifold(lens.data(), new ceres::SubsetManifold(lens_parameters, held));
  }

  void solve(bool robust, int round) {
    take_parameters();
    ceres::Problem problem;
    add_views(problem, robust ? new ceres::HuberLoss(huber) : nullptr);
    // Points are eliminated first, but of two that a distance ties only one can be.
    auto* order = new ceres::ParameterBlockOrdering;
    for (auto& block : unknowns_.boards)
      if (problem.HasParameterBlock(block.data())) order->AddElementToGroup(block.data(), 0);
    const KnownDistance& known = settings_.distance;
    for (const auto& [a, b] : known.instants) {
      double *one = unknowns_.boards[a].data(), *other = unknowns_.boards[b].data();
      if (!problem.HasParameterBlock(one) || !problem.HasParameterBlock(other)) continue;
      using Function = ceres::AutoDiffCostFunction<PointsApart, 1, 6, 6>;
      problem.AddResidualBlock(new Function(new PointsApart{known.metres}),
                               new ceres::HuberLoss(huber), one, other);
      order->AddElementToGroup(other, 1);
    }
    if (known.cameras) {
      using Function = ceres::AutoDiffCostFunction<CamerasApart, 1, 6, 6>;
      problem.AddResidualBlock(new Function(new CamerasApart{known.metres}), nullptr,
                               unknowns_.cameras[(*known.cameras)[0]].data(),
                               unknowns_.cameras[(*known.cameras)[1]].data());
    }
    hold(problem, round);
    for (auto& block : unknowns_.cameras) order->AddElementToGroup(block.data(), 1);
    for (auto& block : unknowns_.lenses)
      if (problem.HasParameterBlock(block.data())) order->AddElementToGroup(block.data(), 1);
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering.reset(order);
    options.num_threads = 1;
    options.max_num_iterations = robust ? 40 : 100;
    options.function_tolerance = robust ? 1e-4 : 1e-10;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    if (!summary.IsSolutionUsable())
      throw Error(Error::Kind::bad_input, "The points cannot be adjusted together: {}.",
                  summary.message);
    accept();
    if (robust) return;
    const double degrees = summary.num_residuals_reduced - summary.num_effective_parameters_reduced;
    noise_ = std::sqrt(2.0 * summary.final_cost / std::max(1.0, degrees));
    settings_.progress("how sure it is", 0.0);
    uncertainties_ = find_uncertainties(take_, problem, unknowns_, first_);
  }

  void accept() {
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      Camera& camera = cameras_[c];
      const Pose pose = from_parameters(unknowns_.cameras[c].data());
      camera.R = pose.R;
      camera.t = pose.t;
      if (take_.cameras[c].known) continue;
      const auto& lens = unknowns_.lenses[c];
      camera.K = from_rows({lens[0], 0.0, lens[2], 0.0, lens[1], lens[3], 0.0, 0.0, 1.0});
      camera.distortion.clear();
      if (settings_.model != LensModel::pinhole)
        camera.distortion.assign(lens.begin() + 4,
                                 lens.end() - (settings_.model == LensModel::four ? 1 : 0));
    }
    for (std::size_t i = 0; i < points_.size(); ++i)
      points_[i] = from_parameters(unknowns_.boards[i].data()).t;
  }

  // The median distance of the views used, px.
  double measure() {
    fits_.assign(take_.views.size(), {});
    std::vector<double> distances;
    for (std::size_t v = 0; v < fits_.size(); ++v) {
      const View& view = take_.views[v];
      const auto pixel = cameras_[view.camera].project(points_[view.instant]);
      const Vec2 residual = pixel ? *pixel - view.corners[0] : Vec2(INFINITY);
      fits_[v] = {glm::length(residual), used_[v], {residual}, {true}};
      if (used_[v]) distances.push_back(fits_[v].rms);
    }
    return median(distances);
  }

  Adjusted result() {
    Adjusted out;
    double sum = 0.0, count = 0.0;
    for (const ViewFit& fit : fits_) {
      sum += fit.used ? fit.rms * fit.rms : 0.0;
      count += fit.used;
    }
    out.rms = std::sqrt(sum / std::max(1.0, count));
    out.noise = noise_;
    out.cameras = cameras_;
    for (const Vec3& point : points_) out.boards.push_back({Mat3(1.0), point});
    out.views = std::move(fits_);
    for (Uncertainty& uncertainty : uncertainties_) uncertainty.scale(noise_);
    out.uncertainties = std::move(uncertainties_);
    return out;
  }

  const Take& take_;
  std::vector<Camera> cameras_;
  const WandSettings& settings_;
  std::size_t first_;
  Unknowns unknowns_;
  std::vector<Vec3> points_;
  std::vector<bool> used_;
  std::vector<ViewFit> fits_;
  std::vector<Uncertainty> uncertainties_;
  double noise_ = 0.0;
};

}  // namespace

Adjusted adjust_points(const Take& take, const std::vector<Camera>& lenses, Placement placement,
                       const WandSettings& settings) {
  return PointAdjuster(take, lenses, placement, settings).run();
}

}  // namespace polyhull::calibration
