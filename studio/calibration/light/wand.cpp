// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/calibration/light/wand.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "base/error.h"

namespace polyhull::calibration {
namespace {

constexpr auto bad = Error::Kind::bad_input;

void check(const Take& take, const WandSettings& settings) {
  if (take.cameras.size() < 2)
    throw Error(bad, "A moved light calibrates two cameras or more; {} was given.",
                take.cameras.size());
  const KnownDistance& known = settings.distance;
  if (known.instants.empty() && !known.cameras)
    throw Error(bad,
                "Nothing says how large the world is; give the wand's length, the distance of two "
                "places or that of two cameras.");
  if (!(known.metres > 0.0) || !std::isfinite(known.metres))
    throw Error(bad, "The known distance is {} m; it must be above 0.", known.metres);
  if (known.cameras && (*known.cameras)[0] == (*known.cameras)[1])
    throw Error(bad, "The known distance is that of a camera to itself; name two cameras.");
  std::vector<std::size_t> by_instant(take.instants.size()), by_camera(take.cameras.size());
  for (const View& view : take.views) {
    if (!std::isfinite(view.corners[0].x) || !std::isfinite(view.corners[0].y))
      throw Error(bad, "Camera '{}' has a point '{}' that is not finite.",
                  take.cameras[view.camera].name, take.instants[view.instant]);
    ++by_instant[view.instant];
  }
  std::size_t shared = 0;
  for (const std::size_t count : by_instant) shared += count >= 2;
  if (shared < least_points)
    throw Error(bad, "{} points were seen by two cameras or more; at least {} are needed.", shared,
                least_points);
  for (const View& view : take.views) by_camera[view.camera] += by_instant[view.instant] >= 2;
  for (std::size_t c = 0; c < by_camera.size(); ++c)
    if (by_camera[c] < least_points)
      throw Error(bad, "Camera '{}' shares {} points with other cameras; at least {} are needed.",
                  take.cameras[c].name, by_camera[c], least_points);
}

Camera start_of(const TakeCamera& camera, double field_of_view) {
  Camera out;
  if (camera.known) out = *camera.known;
  out.name = camera.name;
  out.width = camera.width;
  out.height = camera.height;
  if (camera.known) return out;
  const double f = 0.5 * camera.width / std::tan(0.5 * glm::radians(field_of_view));
  out.K = from_rows(
      {f, 0.0, 0.5 * (camera.width - 1), 0.0, f, 0.5 * (camera.height - 1), 0.0, 0.0, 1.0});
  out.distortion.assign(5, 0.0);
  return out;
}

// Points in a plane leave lenses and, from two cameras, poses open.
void refuse_plane(const Take& take, const Adjusted& adjusted) {
  std::vector<bool> used(take.instants.size(), false);
  for (std::size_t v = 0; v < take.views.size(); ++v)
    if (adjusted.views[v].used) used[take.views[v].instant] = true;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  double count = 0.0;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    const Vec3& p = adjusted.boards[i].t;
    const Eigen::Vector3d x(p.x, p.y, p.z);
    sum += x;
    squares += x * x.transpose();
    count += 1.0;
  }
  const Eigen::Matrix3d spread = squares / count - sum * sum.transpose() / (count * count);
  const Eigen::Vector3d values =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues();
  if (values[0] < 4e-4 * values[2])
    throw Error(bad,
                "All points lie in a plane or on a line ({:.0f} mm off it, {:.0f} mm along it); "
                "move the light at all heights, near and far.",
                1e3 * std::sqrt(std::max(0.0, values[0])), 1e3 * std::sqrt(values[2]));
}

}  // namespace

Take empty_wand_take() {
  Take take;
  take.board.columns = take.board.rows = 1;
  return take;
}

Calibration calibrate_wand(Take take, const WandSettings& settings) {
  check(take, settings);
  std::vector<Camera> lenses;
  for (const TakeCamera& camera : take.cameras)
    lenses.push_back(start_of(camera, settings.field_of_view));
  settings.progress("placing cameras", 0.0);
  Adjusted adjusted = adjust_points(take, lenses, place_by_points(take, lenses), settings);
  refuse_plane(take, adjusted);
  return calibration_of(std::move(take), std::move(adjusted));
}

}  // namespace polyhull::calibration
