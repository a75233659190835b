// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/tracked_pose.h"

#include <cmath>
#include <numbers>

#include "base/error.h"
#include "track/lens/lens_table.h"

namespace polyhull {
namespace {

Mat3 turn(int axis, double degrees) {
  const double angle = degrees * std::numbers::pi / 180.0;
  const double c = std::cos(angle), s = std::sin(angle);
  const int next = (axis + 1) % 3, last = (axis + 2) % 3;
  Mat3 m(1.0);
  m[next][next] = m[last][last] = c;
  m[next][last] = s;
  m[last][next] = -s;
  return m;
}

Mat3 to_scene() {
  return from_rows({1, 0, 0, 0, 0, 1, 0, -1, 0});
}

// From the camera's right, forward and up.
Mat3 right_down_forward() {
  return from_rows({1, 0, 0, 0, 0, -1, 0, 1, 0});
}

void check(bool usable, const char* what) {
  if (!usable) throw Error(Error::Kind::bad_input, "A tracked camera cannot be used: {}.", what);
}

bool usable_length(const std::optional<double>& length) {
  return !length || (std::isfinite(*length) && *length > 0.0);
}

bool usable_lens(const TrackedPose& pose) {
  const std::size_t count = pose.distortion.size();
  bool finite =
      std::isfinite(pose.projection_offset_mm.x) && std::isfinite(pose.projection_offset_mm.y);
  for (const double k : pose.distortion) finite = finite && std::isfinite(k);
  return finite && (count == 0 || count == 4 || count == 5 || count == 8 || count == 12);
}

// The focal lengths in pixels, which are pixel_aspect times as wide as high.
Vec2 focal_pixels(const TrackedPose& pose, int width, int height, double vertical_degrees,
                  double pixel_aspect) {
  if (pose.focal_length_mm && pose.sensor_width_mm)
    return *pose.focal_length_mm / *pose.sensor_width_mm * width * Vec2(1.0, pixel_aspect);
  const Vec2 by_height(1.0 / pixel_aspect, 1.0);
  if (pose.focal_length_mm && pose.sensor_height_mm)
    return *pose.focal_length_mm / *pose.sensor_height_mm * height * by_height;
  check(vertical_degrees > 0.0 && vertical_degrees < 180.0,
        "its field of view must be between 0 and 180 degrees");
  return 0.5 * height / std::tan(vertical_degrees * std::numbers::pi / 360.0) * by_height;
}

}  // namespace

Mat3 axes_of_angles(double pan, double tilt, double roll) {
  return turn(2, pan) * turn(0, tilt) * turn(1, roll);
}

Extrinsics extrinsics_of(const TrackedPose& pose) {
  const Mat3 R = right_down_forward() * glm::transpose(to_scene() * pose.axes);
  return {R, -(R * (to_scene() * pose.place))};
}

void set_extrinsics(TrackedPose& pose, const Extrinsics& extrinsics) {
  const Mat3 to_tracker = glm::transpose(to_scene());
  pose.axes = to_tracker * glm::transpose(extrinsics.R) * right_down_forward();
  pose.place = -(to_tracker * (glm::transpose(extrinsics.R) * extrinsics.t));
}

double aperture_of(const TrackedPose& pose) {
  if (!pose.focal_length_mm || !pose.f_number || !(*pose.f_number > 0.0)) return 0.0;
  const double aperture = 1e-3 * *pose.focal_length_mm / *pose.f_number;
  return std::isfinite(aperture) && aperture > 0.0 ? aperture : 0.0;
}

void add_lens(TrackedPose& pose, const LensState& lens, bool is_at_pupil) {
  constexpr double assumed_width_mm = 36.0;
  if (!pose.focal_length_mm && lens.focal_length_widths) {
    if (!pose.sensor_width_mm) pose.sensor_width_mm = assumed_width_mm;
    pose.focal_length_mm = *lens.focal_length_widths * *pose.sensor_width_mm;
  }
  if (!pose.focal_length_mm) pose.focal_length_mm = lens.focal_length_mm;
  if (!pose.focus_distance_m) pose.focus_distance_m = lens.focus_distance_m;
  if (pose.distortion.empty()) pose.distortion = lens.distortion;
  if (lens.projection_offset_mm && pose.projection_offset_mm == Vec2(0.0))
    pose.projection_offset_mm = *lens.projection_offset_mm;
  if (lens.entrance_pupil_m && !is_at_pupil) pose.place += *lens.entrance_pupil_m * pose.axes[1];
}

Camera camera_of(const TrackedPose& pose, int width, int height, double vertical_degrees,
                 double pixel_aspect) {
  check(width > 0 && height > 0 && pixel_aspect > 0.0 && std::isfinite(pixel_aspect),
        "its picture is empty");
  for (int i = 0; i < 3; ++i) {
    check(std::isfinite(pose.place[i]), "its place is not finite");
    for (int j = 0; j < 3; ++j) check(std::isfinite(pose.axes[i][j]), "its angles are not finite");
  }
  check(usable_length(pose.focal_length_mm) && usable_length(pose.sensor_width_mm) &&
            usable_length(pose.sensor_height_mm),
        "its focal length and its sensor's size must be above 0");
  Camera camera;
  camera.name = "viewport";
  camera.width = width;
  camera.height = height;
  const Vec2 focal = focal_pixels(pose, width, height, vertical_degrees, pixel_aspect);
  check(std::isfinite(focal.x + focal.y) && focal.x > 0.0 && focal.y > 0.0,
        "its focal length is out of range");
  check(usable_lens(pose), "its lens is out of range");
  // From mm on the sensor, which only a known focal length relates to pixels.
  const Vec2 offset =
      pose.focal_length_mm ? focal / *pose.focal_length_mm * pose.projection_offset_mm : Vec2(0.0);
  camera.K = from_rows({focal.x, 0, 0.5 * (width - 1) + offset.x, 0, focal.y,
                        0.5 * (height - 1) + offset.y, 0, 0, 1});
  camera.distortion = pose.distortion;
  const Extrinsics extrinsics = extrinsics_of(pose);
  camera.R = extrinsics.R;
  camera.t = extrinsics.t;
  return camera;
}

}  // namespace polyhull
