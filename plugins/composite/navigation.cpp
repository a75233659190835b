// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/composite/navigation.h"

#include <gst/video/navigation.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace polyhull::element {
namespace {

constexpr double radians_per_pixel = 0.006;
constexpr double key_turn = 0.05;  // radians
constexpr double approach = 0.9;   // per notch of the wheel
constexpr double steepest = 0.49 * std::numbers::pi;

struct View {
  Vec3 eye, target;
};

View view_of(const CompositeSettings& s) {
  return {{s.eye_x, s.eye_y, s.eye_z}, {s.target_x, s.target_y, s.target_z}};
}

void store(const View& view, CompositeSettings& s) {
  s.eye_x = view.eye.x, s.eye_y = view.eye.y, s.eye_z = view.eye.z;
  s.target_x = view.target.x, s.target_y = view.target.y, s.target_z = view.target.z;
}

void turn(View& view, double yaw, double pitch) {
  const Vec3 arm = view.eye - view.target;
  const double distance = glm::length(arm);
  if (!(distance > 1e-9)) return;
  const double azimuth = std::atan2(arm.x, arm.z) + yaw;
  const double height =
      std::clamp(std::asin(std::clamp(arm.y / distance, -1.0, 1.0)) + pitch, -steepest, steepest);
  view.eye = view.target + distance * Vec3(std::sin(azimuth) * std::cos(height), std::sin(height),
                                           std::cos(azimuth) * std::cos(height));
}

void shift(View& view, double x, double y) {
  const Vec3 arm = view.target - view.eye;
  const Vec3 side = glm::cross(arm, Vec3(0, 1, 0));
  if (!(glm::length(side) > 1e-9)) return;
  const Vec3 right = glm::normalize(side);
  const Vec3 up = glm::normalize(glm::cross(right, arm));
  const Vec3 step = glm::length(arm) * radians_per_pixel * 0.3 * (-x * right + y * up);
  view.eye += step;
  view.target += step;
}

void go(View& view, double factor) {
  view.eye = view.target + std::max(factor, 0.01) * (view.eye - view.target);
}

bool press(View& view, const std::string& key) {
  if (key == "Left")
    turn(view, -key_turn, 0.0);
  else if (key == "Right")
    turn(view, key_turn, 0.0);
  else if (key == "Up")
    turn(view, 0.0, key_turn);
  else if (key == "Down")
    turn(view, 0.0, -key_turn);
  else if (key == "plus" || key == "KP_Add")
    go(view, approach);
  else if (key == "minus" || key == "KP_Subtract")
    go(view, 1.0 / approach);
  else
    return false;
  return true;
}

}  // namespace

bool ViewportControl::apply(GstEvent* event, CompositeSettings& settings) {
  View view = view_of(settings);
  bool moved = false;
  switch (gst_navigation_event_get_type(event)) {
    case GST_NAVIGATION_EVENT_MOUSE_BUTTON_PRESS:
      gst_navigation_event_parse_mouse_button_event(event, &button_, &x_, &y_);
      break;
    case GST_NAVIGATION_EVENT_MOUSE_BUTTON_RELEASE:
      button_ = 0;
      break;
    case GST_NAVIGATION_EVENT_MOUSE_MOVE: {
      double x = 0.0, y = 0.0;
      if (!gst_navigation_event_parse_mouse_move_event(event, &x, &y)) break;
      if (button_ == 1) turn(view, (x_ - x) * radians_per_pixel, (y - y_) * radians_per_pixel);
      if (button_ == 2 || button_ == 3) shift(view, x - x_, y - y_);
      moved = button_ != 0;
      x_ = x;
      y_ = y;
      break;
    }
    case GST_NAVIGATION_EVENT_MOUSE_SCROLL: {
      double x = 0.0, y = 0.0, dx = 0.0, dy = 0.0;
      gst_navigation_event_parse_mouse_scroll_event(event, &x, &y, &dx, &dy);
      go(view, dy > 0.0 ? approach : 1.0 / approach);
      moved = dy != 0.0;
      break;
    }
    case GST_NAVIGATION_EVENT_KEY_PRESS: {
      const gchar* key = nullptr;
      if (gst_navigation_event_parse_key_event(event, &key) && key) moved = press(view, key);
      break;
    }
    default:
      break;
  }
  if (moved) store(view, settings);
  return moved;
}

}  // namespace polyhull::element
