// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/calibration/adjust.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/median.h"
#include "studio/calibration/adjust_internal.h"

namespace polyhull::calibration {
namespace {

// Distances from which Huber's loss grows linearly only, px.
constexpr double huber = 2.0;
constexpr int most_adjustments = 5;

std::array<double, 12> twelve(const Camera& camera) {
  std::array<double, 12> k{};
  std::copy(camera.distortion.begin(), camera.distortion.end(), k.begin());
  return k;
}

class Adjuster {
 public:
  Adjuster(const Take& take, const std::vector<LensStart>& starts, const Placement& placement,
           LensModel model, const Progress& progress)
      : take_(take), starts_(starts), first_(placement.first), model_(model), progress_(progress) {
    for (const LensStart& start : starts) {
      const Camera& camera = start.camera;
      std::array<double, lens_parameters> lens{camera.K[0][0], camera.K[1][1], camera.K[2][0],
                                               camera.K[2][1]};
      for (std::size_t i = 0; i < 5 && i < camera.distortion.size(); ++i)
        lens[4 + i] = camera.distortion[i];
      unknowns_.lenses.push_back(lens);
    }
    for (const Pose& pose : placement.cameras) unknowns_.cameras.push_back(to_parameters(pose));
    for (const Pose& pose : placement.boards) unknowns_.boards.push_back(to_parameters(pose));
  }

  Adjusted run() {
    measure();
    for (ViewFit& fit : fits_) fit.used = std::isfinite(fit.rms);
    for (int round = 0; round < most_adjustments; ++round) {
      progress_("adjusting all cameras", static_cast<double>(round) / most_adjustments);
      solve(true);
      const std::vector<ViewFit> before = fits_;
      measure();
      if (!choose(before)) break;
    }
    solve(false);
    measure();
    progress_("adjusting all cameras", 1.0);
    return result();
  }

 private:
  void add_view(ceres::Problem& problem, std::size_t v, ceres::LossFunction* loss) {
    const View& view = take_.views[v];
    const std::optional<Camera>& known = take_.cameras[view.camera].known;
    double* camera = unknowns_.cameras[view.camera].data();
    double* board = unknowns_.boards[view.instant].data();
    for (std::size_t i = 0; i < view.ids.size(); ++i) {
      if (!fits_[v].corner_used[i]) continue;
      const Vec3 corner = take_.board.corner(view.ids[i]);
      if (known) {
        using Function = ceres::AutoDiffCostFunction<KnownLensResidual, 2, 6, 6>;
        problem.AddResidualBlock(
            new Function(new KnownLensResidual{corner, view.corners[i], known->K, twelve(*known)}),
            loss, camera, board);
      } else {
        using Function = ceres::AutoDiffCostFunction<CornerResidual, 2, 9, 6, 6>;
        problem.AddResidualBlock(new Function(new CornerResidual{corner, view.corners[i]}), loss,
                                 unknowns_.lenses[view.camera].data(), camera, board);
      }
    }
  }

  void hold_constants(ceres::Problem& problem) {
    if (problem.HasParameterBlock(unknowns_.cameras[first_].data()))
      problem.SetParameterBlockConstant(unknowns_.cameras[first_].data());
    std::vector<int> held;
    if (model_ == LensModel::pinhole) held = {4, 5, 6, 7, 8};
    if (model_ == LensModel::four) held = {8};
    for (auto& lens : unknowns_.lenses)
      if (!held.empty() && problem.HasParameterBlock(lens.data()))
        problem.SetManifold(lens.data(), new ceres::SubsetManifold(lens_parameters, held));
  }

  void fill(ceres::Problem& problem, bool robust) {
    ceres::LossFunction* loss = robust ? new ceres::HuberLoss(huber) : nullptr;
    for (std::size_t v = 0; v < take_.views.size(); ++v)
      if (fits_[v].used) add_view(problem, v, loss);
    hold_constants(problem);
  }

  void solve(bool robust) {
    ceres::Problem problem;
    fill(problem, robust);
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    // Boards are eliminated first; on one thread sums come in one order.
    auto* order = new ceres::ParameterBlockOrdering;
    for (auto& board : unknowns_.boards)
      if (problem.HasParameterBlock(board.data())) order->AddElementToGroup(board.data(), 0);
    for (auto* blocks : {&unknowns_.cameras})
      for (auto& block : *blocks)
        if (problem.HasParameterBlock(block.data())) order->AddElementToGroup(block.data(), 1);
    for (auto& lens : unknowns_.lenses)
      if (problem.HasParameterBlock(lens.data())) order->AddElementToGroup(lens.data(), 1);
    options.linear_solver_ordering.reset(order);
    options.num_threads = 1;
    options.max_num_iterations = robust ? 60 : 100;
    options.function_tolerance = robust ? 1e-4 : 1e-10;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    if (!summary.IsSolutionUsable())
      throw Error(Error::Kind::bad_input, "The views cannot be adjusted together: {}.",
                  summary.message);
    if (robust) return;
    const double degrees = summary.num_residuals_reduced - summary.num_effective_parameters_reduced;
    noise_ = std::sqrt(2.0 * summary.final_cost / std::max(1.0, degrees));
    progress_("how sure it is", 0.0);
    uncertainties_ = find_uncertainties(take_, problem, unknowns_, first_);
  }

  Camera camera_of(std::size_t c) const {
    Camera camera = starts_[c].camera;
    const Pose pose = from_parameters(unknowns_.cameras[c].data());
    camera.R = pose.R;
    camera.t = pose.t;
    if (take_.cameras[c].known) return camera;
    const auto& lens = unknowns_.lenses[c];
    camera.K = from_rows({lens[0], 0.0, lens[2], 0.0, lens[1], lens[3], 0.0, 0.0, 1.0});
    camera.distortion.clear();
    if (model_ != LensModel::pinhole)
      camera.distortion.assign(lens.begin() + 4, lens.end() - (model_ == LensModel::four ? 1 : 0));
    return camera;
  }

  // All views' residuals, also of those left out.
  void measure() {
    fits_.resize(take_.views.size());
    for (std::size_t v = 0; v < fits_.size(); ++v) {
      const View& view = take_.views[v];
      const Camera camera = camera_of(view.camera);
      const Pose board = from_parameters(unknowns_.boards[view.instant].data());
      ViewFit& fit = fits_[v];
      fit.residuals.assign(view.ids.size(), {});
      fit.corner_used.resize(view.ids.size(), true);
      double sum = 0.0, count = 0.0;
      for (std::size_t i = 0; i < view.ids.size(); ++i) {
        const auto pixel = camera.project(board(take_.board.corner(view.ids[i])));
        fit.residuals[i] = pixel ? *pixel - view.corners[i] : Vec2(INFINITY);
        if (!fit.corner_used[i]) continue;
        sum += glm::dot(fit.residuals[i], fit.residuals[i]);
        count += 1.0;
      }
      fit.rms = std::sqrt(sum / std::max(1.0, count));
    }
  }

  // Which corners and views take part from now on, by their residuals. Whether that changed.
  bool choose(const std::vector<ViewFit>& before) {
    std::vector<double> deviations, views;
    for (const ViewFit& fit : fits_) {
      if (!fit.used) continue;
      for (const Vec2& r : fit.residuals) deviations.push_back(glm::length(r));
      views.push_back(fit.rms);
    }
    // The median length of two Gaussian coordinates is 1.177 of their deviation.
    const double corner_limit = std::max(0.05, 6.0 * median(deviations) / 1.177);
    const double view_limit = std::max(0.05, 3.0 * median(views));
    bool changed = false;
    for (std::size_t v = 0; v < fits_.size(); ++v) {
      ViewFit& fit = fits_[v];
      double sum = 0.0;
      std::size_t good = 0;
      for (std::size_t i = 0; i < fit.residuals.size(); ++i) {
        const double length = glm::length(fit.residuals[i]);
        fit.corner_used[i] = length <= corner_limit;
        good += fit.corner_used[i];
        sum += fit.corner_used[i] ? length * length : 0.0;
      }
      const double rms = std::sqrt(sum / static_cast<double>(std::max<std::size_t>(good, 1)));
      fit.used = good >= 6 && 4 * good >= 3 * fit.residuals.size() && rms <= view_limit;
      if (!fit.used) fit.corner_used.assign(fit.residuals.size(), true);
      changed = changed || fit.used != before[v].used || fit.corner_used != before[v].corner_used;
    }
    for (std::size_t c = 0; c < take_.cameras.size(); ++c) require_views(c);
    return changed;
  }

  void require_views(std::size_t c) const {
    for (std::size_t v = 0; v < fits_.size(); ++v)
      if (take_.views[v].camera == c && fits_[v].used) return;
    throw Error(Error::Kind::bad_input,
                "No view of camera '{}' fits those of the other cameras; was it moved, or are its "
                "pictures of other instants?",
                take_.cameras[c].name);
  }

  Adjusted result() {
    Adjusted out;
    double sum = 0.0, count = 0.0;
    for (const ViewFit& fit : fits_) {
      if (!fit.used) continue;
      for (std::size_t i = 0; i < fit.residuals.size(); ++i) {
        if (!fit.corner_used[i]) continue;
        sum += glm::dot(fit.residuals[i], fit.residuals[i]);
        count += 1.0;
      }
    }
    out.rms = std::sqrt(sum / std::max(1.0, count));
    out.noise = noise_;
    for (std::size_t c = 0; c < take_.cameras.size(); ++c) out.cameras.push_back(camera_of(c));
    for (const auto& board : unknowns_.boards) out.boards.push_back(from_parameters(board.data()));
    out.views = std::move(fits_);
    for (Uncertainty& uncertainty : uncertainties_) uncertainty.scale(noise_);
    out.uncertainties = std::move(uncertainties_);
    return out;
  }

  const Take& take_;
  const std::vector<LensStart>& starts_;
  std::size_t first_;
  LensModel model_;
  const Progress& progress_;
  Unknowns unknowns_;
  std::vector<ViewFit> fits_;
  std::vector<Uncertainty> uncertainties_;
  double noise_ = 0.0;
};

}  // namespace

Adjusted adjust(const Take& take, const std::vector<LensStart>& starts, const Placement& placement,
                LensModel model, const Progress& progress) {
  return Adjuster(take, starts, placement, model, progress).run();
}

}  // namespace polyhull::calibration
