// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/check.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "rig/floor.h"
#include "rig/lens.h"
#include "rig/plausible.h"

namespace polyhull {
namespace {

constexpr double person = 1.75;  // metres

// How large a person in the middle of the stage is in the pictures: what a wrong unit changes.
std::string person_text(const Rig& rig, const Vec3& focus) {
  double least = INFINITY, most = 0.0;
  for (const Camera& camera : rig.cameras) {
    const double pixels =
        person / rig.metres_per_unit() / glm::length(focus - camera.centre()) * camera.K[1][1];
    least = std::min(least, pixels);
    most = std::max(most, pixels);
  }
  return fmt::format("a person of {:g} m there is {:.0f} to {:.0f} px high\n", person, least, most);
}

// The middle of the stage.
std::optional<Vec3> focus_of(const Rig& rig) {
  if (rig.bounds) return 0.5 * (rig.bounds->min + rig.bounds->max);
  return common_point(rig);
}

struct LensReport {
  double largest_shift = 0.0;  // px, over the frame
  double largest_error = 0.0;  // px, of undistort and distort again, where that is possible
  double outside_share = 0.0;  // of the frame that the model cannot undistort
};

LensReport examine_lens(const Camera& camera) {
  constexpr int steps = 32;
  LensReport report;
  const Lens lens(camera);
  if (!lens.active()) return report;
  for (int i = 0; i <= steps; ++i)
    for (int j = 0; j <= steps; ++j) {
      const Vec2 real((camera.width - 1.0) * i / steps, (camera.height - 1.0) * j / steps);
      const Vec2 ideal = lens.undistort(real);
      const double error = glm::length(lens.distort(ideal) - real);
      if (error > 0.01) continue;
      report.largest_error = std::max(report.largest_error, error);
      report.largest_shift = std::max(report.largest_shift, glm::length(ideal - real));
    }
  report.outside_share = lost_share(camera, steps);
  return report;
}

double degrees(double radians) {
  return radians * 180.0 / std::numbers::pi;
}

double field(double focal, double size) {
  return degrees(2.0 * std::atan(0.5 * size / focal));
}

void examine_camera(const Rig& rig, const Camera& camera, const std::optional<Vec3>& focus,
                    RigReport& report) {
  const Vec3 centre = camera.centre();
  const LensReport lens = examine_lens(camera);
  std::optional<Vec2> pixel;
  if (focus) pixel = camera.project(*focus);
  report.table += fmt::format(
      "{:14} {:4}x{:<4}  {:9.4g} {:9.4g} {:9.4g}  {:7.1f} {:7.1f}  {:5.1f} x {:<5.1f} {:>9}  ",
      camera.name, camera.width, camera.height, centre.x, centre.y, centre.z, camera.K[0][0],
      camera.K[1][1], field(camera.K[0][0], camera.width), field(camera.K[1][1], camera.height),
      focus ? fmt::format("{:.4g}", glm::length(*focus - centre)) : "-");
  if (pixel)
    report.table += fmt::format("{:7.1f} {:7.1f}  ", pixel->x, pixel->y);
  else
    report.table += "      -       -  ";
  report.table += fmt::format("{:6.1f}\n", lens.largest_shift);
  const std::string& name = camera.name;
  if (focus && !pixel)
    report.warnings.push_back(fmt::format(
        "{} looks away from the middle of the stage: its rotation or the sign of its axes is wrong",
        name));
  else if (pixel && (pixel->x < 0 || pixel->y < 0 || pixel->x > camera.width - 1 ||
                     pixel->y > camera.height - 1))
    report.warnings.push_back(
        fmt::format("{} does not have the middle of the stage in its picture", name));
  const double aspect = camera.K[0][0] / camera.K[1][1];
  if (std::abs(aspect - 1.0) > 0.03)
    report.warnings.push_back(
        fmt::format("{} has pixels that are not square: fx / fy is {:.3f}", name, aspect));
  if (camera.K[2][0] < 0 || camera.K[2][1] < 0 || camera.K[2][0] > camera.width - 1 ||
      camera.K[2][1] > camera.height - 1)
    report.warnings.push_back(fmt::format(
        "{} has its principal point ({:.1f}, {:.1f}) outside the picture; check the picture's size",
        name, camera.K[2][0], camera.K[2][1]));
  else if (std::max(std::abs(camera.K[2][0] / camera.width - 0.5),
                    std::abs(camera.K[2][1] / camera.height - 0.5)) > 0.2)
    report.warnings.push_back(fmt::format(
        "{} has its principal point ({:.1f}, {:.1f}) far from the middle of its picture "
        "of {}x{}: unless it shows a part of the sensor, the calibration is for "
        "pictures of another size",
        name, camera.K[2][0], camera.K[2][1], camera.width, camera.height));
  if (lens.outside_share > 0.0)
    report.warnings.push_back(
        fmt::format("{}: the lens model cannot be inverted on {:.1f} % of the picture (its "
                    "corners): contours there move to the rim of where it can",
                    name, 100.0 * lens.outside_share));
  if (lens.largest_error > 1e-6)
    report.warnings.push_back(fmt::format(
        "{}: undistorting and distorting again is off by {:.2g} px", name, lens.largest_error));
  if (rig.bounds && glm::all(glm::greaterThanEqual(centre, rig.bounds->min)) &&
      glm::all(glm::lessThanEqual(centre, rig.bounds->max)))
    report.warnings.push_back(fmt::format("{} stands inside the bounds", name));
}

void examine_pairs(const Rig& rig, const std::optional<Vec3>& focus, RigReport& report) {
  for (std::size_t i = 0; i < rig.cameras.size(); ++i)
    for (std::size_t j = i + 1; j < rig.cameras.size(); ++j) {
      const Vec3 a = rig.cameras[i].centre(), b = rig.cameras[j].centre();
      const double scale = focus ? glm::length(*focus - a) : glm::length(a);
      if (glm::length(a - b) < 1e-3 * scale)
        report.warnings.push_back(
            fmt::format("{} and {} stand at the same place: the second adds nothing",
                        rig.cameras[i].name, rig.cameras[j].name));
    }
}

}  // namespace

RigReport examine_rig(const Rig& rig) {
  RigReport report;
  const std::optional<Vec3> focus = focus_of(rig);
  report.table +=
      fmt::format("{} cameras, unit {} ({:g} m), up ({:g}, {:g}, {:g})\n", rig.cameras.size(),
                  rig.unit, rig.metres_per_unit(), rig.up.x, rig.up.y, rig.up.z);
  if (rig.bounds)
    report.table += fmt::format("bounds ({:g}, {:g}, {:g}) to ({:g}, {:g}, {:g})\n",
                                rig.bounds->min.x, rig.bounds->min.y, rig.bounds->min.z,
                                rig.bounds->max.x, rig.bounds->max.y, rig.bounds->max.z);
  if (focus)
    report.table += fmt::format("middle of the stage ({:g}, {:g}, {:g}){}\n", focus->x, focus->y,
                                focus->z, rig.bounds ? "" : ", where the optical axes meet best") +
                    person_text(rig, *focus);
  report.table +=
      "name           picture          centre x         y         z       fx      fy   view in "
      "degrees   distance  middle's pixel   lens px\n";
  for (const Camera& camera : rig.cameras) examine_camera(rig, camera, focus, report);
  if (rig.cameras.size() < 2) report.warnings.push_back("a hull needs at least two cameras");
  examine_pairs(rig, focus, report);
  if (!rig.bounds && looks_down(rig))
    report.warnings.push_back(
        "all cameras look down and the rig has no bounds: nothing says where the floor is, so that "
        "hulls reach some centimetres below the soles; `polyhull-rig level` puts the floor and the "
        "bounds into the rig file");
  if (const Camera* camera = world_camera(rig))
    report.warnings.push_back(fmt::format(
        "the world is that of {}, as of a calibration that knows no floor: the floor and what is "
        "up "
        "are unknown, up is only how that camera is held; `polyhull-rig level` puts both into the "
        "rig file",
        camera->name));
  for (std::string& note : implausible_sizes(rig)) report.warnings.push_back(std::move(note));
  return report;
}

}  // namespace polyhull
