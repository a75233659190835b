// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/rig.h"

#include <charconv>
#include <cmath>
#include <set>

#include "base/error.h"
#include "base/rotation.h"
#include "rig/rig_error.h"

namespace polyhull {
namespace {

bool finite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

void validate_intrinsics(const Camera& camera, const std::string& where) {
  constexpr int largest_side = 32768;
  if (camera.width < 1 || camera.height < 1 || camera.width > largest_side ||
      camera.height > largest_side)
    fail_rig(where, fmt::format("the picture size is {}x{}; each side must be 1 to 32768 pixels",
                                camera.width, camera.height));
  const auto k = to_rows(camera.K);
  for (const double value : k)
    if (!std::isfinite(value)) fail_rig(where, "K has a number that is not finite");
  if (!(k[0] > 0.0) || !(k[4] > 0.0))
    fail_rig(
        where,
        fmt::format(
            "the focal lengths K[0][0] and K[1][1] are {:g} and {:g} px; both must be positive",
            k[0], k[4]));
  if (k[3] != 0.0 || k[6] != 0.0 || k[7] != 0.0 || k[8] != 1.0)
    fail_rig(
        where,
        "K must be upper triangular with K[2][2] = 1: [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]");
  const std::size_t count = camera.distortion.size();
  if (count != 0 && count != 4 && count != 5 && count != 8 && count != 12)
    fail_rig(where,
             fmt::format("distortion has {} coefficients; OpenCV's model takes 4 (k1 k2 p1 p2), "
                         "5 (k3), 8 (k4 k5 k6) or 12 (s1 s2 s3 s4)",
                         count));
  for (const double value : camera.distortion)
    if (!std::isfinite(value)) fail_rig(where, "distortion has a number that is not finite");
}

void validate_pose(const Camera& camera, const std::string& where) {
  for (const double value : to_rows(camera.R))
    if (!std::isfinite(value)) fail_rig(where, "R has a number that is not finite");
  const double worst = orthonormal_error(camera.R);
  if (worst > 1e-4)
    fail_rig(where,
             fmt::format("R is not a rotation: its rows are not orthonormal (R R^T differs from "
                         "the identity by {:g})",
                         worst));
  if (glm::determinant(camera.R) < 0.0)
    fail_rig(
        where,
        "R is a reflection (determinant -1): the frame is left-handed. x_cam = R X + t wants z "
        "forward, x right, y down in a right-handed world");
  if (!finite(camera.t)) fail_rig(where, "t has a number that is not finite");
}

void validate_colour(const Camera& camera, const std::string& where) {
  constexpr double most = 16.0, least_determinant = 1e-4;
  for (const double number : to_rows(camera.colour))
    if (!(std::abs(number) <= most))
      fail_rig(where,
               fmt::format("the colour matrix has a number that is not finite or beyond {}", most));
  if (!(glm::determinant(camera.colour) >= least_determinant))
    fail_rig(where,
             fmt::format("the colour matrix makes colours alike that differ: its determinant, "
                         "{:g}, is below {}",
                         glm::determinant(camera.colour), least_determinant));
}

}  // namespace

const Camera* Rig::find(std::string_view name) const {
  for (const Camera& camera : cameras)
    if (camera.name == name) return &camera;
  return nullptr;
}

double Rig::metres_per_unit() const {
  if (unit == "m") return 1.0;
  if (unit == "cm") return 0.01;
  if (unit == "mm") return 0.001;
  if (unit == "in") return 0.0254;
  if (unit == "ft") return 0.3048;
  double value = 0.0;
  const char* end = unit.data() + unit.size();
  const auto [rest, error] = std::from_chars(unit.data(), end, value);
  if (error != std::errc() || rest != end || !std::isfinite(value) || !(value > 0.0))
    throw Error(Error::Kind::bad_input,
                "The unit '{}' is none of m, cm, mm, in and ft, and no positive number of metres "
                "such as 0.37.",
                unit);
  return value;
}

std::string likely_unit(double units, double usual) {
  std::string best = "m";
  double least = INFINITY;
  for (const char* unit : {"m", "cm", "mm"}) {
    Rig rig;
    rig.unit = unit;
    const double off = std::abs(std::log(units * rig.metres_per_unit() / usual));
    if (off < least) least = off, best = unit;
  }
  return best;
}

void validate_camera(const Camera& camera, const std::string& where) {
  validate_intrinsics(camera, where);
  validate_pose(camera, where);
  validate_colour(camera, where);
}

void validate_rig(const Rig& rig, const std::string& source) {
  if (rig.cameras.empty()) fail_rig(source, "the rig has no cameras");
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const Camera& camera = rig.cameras[i];
    const std::string where = fmt::format("{}: cameras[{}] ('{}')", source, i, camera.name);
    if (camera.name.empty()) fail_rig(where, "the name is empty");
    if (!names.insert(camera.name).second)
      fail_rig(where, "another camera has the same name; each name may occur once");
    validate_camera(camera, where);
  }
  if (rig.bounds) {
    if (!finite(rig.bounds->min) || !finite(rig.bounds->max))
      fail_rig(source, "bounds has a number that is not finite");
    for (int axis = 0; axis < 3; ++axis)
      if (!(rig.bounds->min[axis] < rig.bounds->max[axis]))
        fail_rig(source, fmt::format("bounds are inside out or flat: min is not below max in {}",
                                     "xyz"[axis]));
  }
  if (!finite(rig.up) || !(glm::length(rig.up) > 0.0))
    fail_rig(source, "up must be a direction: three finite numbers, not all zero");
  try {
    rig.metres_per_unit();
  } catch (const Error& error) {
    throw Error(error.kind(), "{}: {}", source, error.what());
  }
}

}  // namespace polyhull
