// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/viewport_control.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace polyhull {
namespace {

constexpr double turn_per_height =
    std::numbers::pi;  // radians for a drag over the picture's height
constexpr double key_turn = std::numbers::pi / 36.0;  // 5 degrees
constexpr double key_shift = 0.05;                    // of the distance to the target
constexpr double wheel_step = 0.1;                    // logarithm of the distance
constexpr double steepest = 0.98 * std::numbers::pi / 2.0;
constexpr double most_nearness = 4.0;

}  // namespace

void ViewportControl::press(int button, double x, double y) {
  button_ = button;
  x_ = x;
  y_ = y;
}

void ViewportControl::release(int button) {
  if (button == button_) button_ = 0;
}

bool ViewportControl::move(double x, double y, int picture_height) {
  const double dx = (x - x_) / std::max(picture_height, 1),
               dy = (y - y_) / std::max(picture_height, 1);
  x_ = x;
  y_ = y;
  if (button_ == 0 || (dx == 0.0 && dy == 0.0) || !std::isfinite(dx) || !std::isfinite(dy))
    return false;
  if (button_ == 1) {
    yaw_ -= turn_per_height * dx;
    pitch_ += turn_per_height * dy;
  } else {
    shift_ += Vec3(-dx, dy, 0.0);
  }
  return true;
}

bool ViewportControl::wheel(double steps) {
  if (steps == 0.0 || !std::isfinite(steps)) return false;
  nearness_ = std::clamp(nearness_ - wheel_step * steps, -most_nearness, most_nearness);
  return true;
}

bool ViewportControl::key(std::string_view key) {
  if (key == "Left")
    yaw_ -= key_turn;
  else if (key == "Right")
    yaw_ += key_turn;
  else if (key == "Up")
    pitch_ += key_turn;
  else if (key == "Down")
    pitch_ -= key_turn;
  else if (key == "w" || key == "plus" || key == "KP_Add")
    return wheel(1.0);
  else if (key == "s" || key == "minus" || key == "KP_Subtract")
    return wheel(-1.0);
  else if (key == "a" || key == "d")
    shift_.x += key == "d" ? key_shift : -key_shift;
  else if (key == "q" || key == "e")
    shift_.y += key == "e" ? key_shift : -key_shift;
  else if (key == "Home") {
    const bool was_changed = changed();
    *this = ViewportControl{};
    return was_changed;
  } else
    return false;
  return true;
}

ViewportPose ViewportControl::apply(const ViewportPose& pose) const {
  if (!changed()) return pose;
  const Vec3 from_target = pose.eye - pose.target;
  const double distance = glm::length(from_target);
  if (!(distance > 0.0)) return pose;
  const double heading = std::atan2(from_target.x, from_target.z) + yaw_;
  const double height = std::asin(std::clamp(from_target.y / distance, -1.0, 1.0));
  // The pose's own height may be anything; the operator's turn ends before the pole.
  const double raised =
      std::clamp(height + pitch_, std::min(-steepest, height), std::max(steepest, height));
  const Vec3 back(std::sin(heading) * std::cos(raised), std::sin(raised),
                  std::cos(heading) * std::cos(raised));
  const double new_distance = distance * std::exp(nearness_);
  const Vec3 right(std::cos(heading), 0.0, -std::sin(heading));
  const Vec3 up = glm::cross(back, right);
  const Vec3 moved = pose.target + new_distance * (shift_.x * right + shift_.y * up);
  return {moved + new_distance * back, moved};
}

ViewportPose ViewportControl::take(const ViewportPose& pose) {
  const ViewportPose moved = apply(pose);
  yaw_ = pitch_ = nearness_ = 0.0;
  shift_ = Vec3(0.0);
  return moved;
}

}  // namespace polyhull
