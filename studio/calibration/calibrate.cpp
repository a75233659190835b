// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/calibration/calibrate.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/median.h"

namespace polyhull::calibration {
namespace {

double trace(const Mat3& m) {
  return m[0][0] + m[1][1] + m[2][2];
}

// Views by camera, in the take's order.
std::vector<View> views_of(const Take& take, std::size_t c) {
  std::vector<View> out;
  for (const View& view : take.views)
    if (view.camera == c) out.push_back(view);
  return out;
}

// Cells of the picture with a corner in or beside them.
class Coverage {
 public:
  explicit Coverage(const TakeCamera& camera) : camera_(camera) {}

  void add(const Vec2& corner) {
    const int x = static_cast<int>(std::floor(columns * (corner.x + 0.5) / camera_.width));
    const int y = static_cast<int>(std::floor(rows * (corner.y + 0.5) / camera_.height));
    for (int j = std::max(0, y - 1); j <= std::min(rows - 1, y + 1); ++j)
      for (int i = std::max(0, x - 1); i <= std::min(columns - 1, x + 1); ++i)
        seen_[j * columns + i] = true;
  }

  double share() const {
    return static_cast<double>(std::count(seen_.begin(), seen_.end(), true)) / (columns * rows);
  }

 private:
  static constexpr int columns = 16, rows = 9;
  const TakeCamera& camera_;
  std::array<bool, static_cast<std::size_t>(columns) * rows> seen_{};
};

/// What \p adjusted says of camera \p c of \p take.
CameraFit fit_of(const Take& take, const Adjusted& adjusted, std::size_t c) {
  CameraFit out;
  Coverage coverage(take.cameras[c]);
  std::vector<double> distances;
  double sum = 0.0, count = 0.0;
  for (std::size_t v = 0; v < take.views.size(); ++v) {
    const View& view = take.views[v];
    const ViewFit& fit = adjusted.views[v];
    if (view.camera != c) continue;
    ++(fit.used ? out.views : out.left_out);
    if (!fit.used) continue;
    const Vec3 middle = adjusted.boards[view.instant](take.board.middle());
    distances.push_back(glm::length(adjusted.cameras[c].to_camera(middle)));
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      if (!fit.corner_used[i]) continue;
      coverage.add(view.corners[i]);
      sum += glm::dot(fit.residuals[i], fit.residuals[i]);
      count += 1.0;
    }
  }
  out.rms = std::sqrt(sum / std::max(1.0, count));
  out.coverage = coverage.share();
  out.distance = median(distances);
  out.centre_sigma = std::sqrt(trace(adjusted.uncertainties[c].centre));
  out.rotation_sigma = glm::degrees(std::sqrt(trace(adjusted.uncertainties[c].rotation)));
  return out;
}

}  // namespace

Calibration calibration_of(Take take, Adjusted adjusted) {
  Calibration out;
  out.adjusted = std::move(adjusted);
  out.take = std::move(take);
  for (std::size_t c = 0; c < out.take.cameras.size(); ++c)
    out.cameras.push_back(fit_of(out.take, out.adjusted, c));
  out.rig.cameras = out.adjusted.cameras;
  out.rig.up = Vec3(0.0, -1.0, 0.0);  // a camera's y points down
  return out;
}

Calibration calibrate(Take take, const Settings& settings) {
  check_take(take);
  std::vector<LensStart> starts;
  for (std::size_t c = 0; c < take.cameras.size(); ++c) {
    settings.progress("each camera alone", static_cast<double>(c) / take.cameras.size());
    starts.push_back(start_lens(take, c, views_of(take, c), settings.model));
  }
  settings.progress("each camera alone", 1.0);
  const Placement placement = place_cameras(take, starts);
  Adjusted adjusted = adjust(take, starts, placement, settings.model, settings.progress);
  return calibration_of(std::move(take), std::move(adjusted));
}

std::vector<std::string> Calibration::faults(const Bar& bar) const {
  std::vector<std::string> out;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const CameraFit& fit = cameras[c];
    const std::string& name = take.cameras[c].name;
    const double focal = adjusted.uncertainties[c].lens[0] / adjusted.cameras[c].K[0][0];
    if (!(fit.rms <= bar.rms))
      out.push_back(
          fmt::format("'{}': corners are {:.2f} px (root mean square) from where they should be; "
                      "{:.2f} would be good.",
                      name, fit.rms, bar.rms));
    if (!(fit.centre_sigma <= bar.centre * fit.distance))
      out.push_back(fmt::format(
          "'{}': its place is known to {:.1f} mm only; more views that it shares with others help.",
          name, 1e3 * fit.centre_sigma));
    if (static_cast<double>(fit.left_out) >
        bar.left_out * static_cast<double>(fit.views + fit.left_out))
      out.push_back(fmt::format("'{}': {} of its {} views contradict the others.", name,
                                fit.left_out, fit.views + fit.left_out));
    if (take.cameras[c].known) continue;
    if (!(focal <= bar.focal))
      out.push_back(fmt::format(
          "'{}': its focal length is known to {:.2f} % only; tilt the board more, bring it nearer.",
          name, 1e2 * focal));
    if (fit.views < bar.views)
      out.push_back(
          fmt::format("'{}': {} views; at least {} are needed.", name, fit.views, bar.views));
    if (fit.coverage < bar.coverage)
      out.push_back(
          fmt::format("'{}': corners were seen in {:.0f} % of its picture only; hold the board "
                      "into its corners.",
                      name, 1e2 * fit.coverage));
  }
  return out;
}

}  // namespace polyhull::calibration
