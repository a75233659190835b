// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/viewport.h"

#include <fmt/core.h>
#include <gst/video/navigation.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>
#include <system_error>
#include <utility>

#include "rig/lens.h"

namespace polyhull::element {
namespace {

using S = ViewportSettings;
constexpr double far = 1e6;

/// The numbers of "x,y,z", with blanks or without; none: it is no such text.
std::optional<Vec3> three_numbers(std::string_view text) {
  Vec3 result;
  const auto skip_blanks = [&] {
    text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
  };
  for (int i = 0; i < 3; ++i) {
    skip_blanks();
    if (i > 0) {
      if (!text.starts_with(',')) return std::nullopt;
      text.remove_prefix(1);
      skip_blanks();
    }
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), result[i]);
    if (error != std::errc() || !(std::abs(result[i]) <= far)) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  }
  skip_blanks();
  return text.empty() ? std::optional(result) : std::nullopt;
}

/// A short way to set three numbers at once, which are read where they are kept.
template <auto X, auto Y, auto Z>
constexpr Property<S> place_property(const char* name, const char* blurb) {
  return {name,
          blurb,
          -far,
          far,
          Change::live,
          [](const Property<S>& p) {
            return g_param_spec_string(
                p.name, p.name, p.blurb, nullptr,
                static_cast<GParamFlags>(G_PARAM_WRITABLE | G_PARAM_STATIC_STRINGS |
                                         GST_PARAM_MUTABLE_PLAYING));
          },
          [](S& settings, const GValue* value) {
            const gchar* text = g_value_get_string(value);
            const std::optional<Vec3> place = three_numbers(text != nullptr ? text : "");
            if (!place) return false;
            settings.*X = place->x, settings.*Y = place->y, settings.*Z = place->z;
            return true;
          },
          [](const S&, GValue*) {},
          "three numbers as in 1.15,1.5,2.75, each"};
}

}  // namespace

std::vector<double> ViewportSettings::distortion() const {
  if (k1 == 0.0 && k2 == 0.0 && k3 == 0.0 && p1 == 0.0 && p2 == 0.0) return {};
  return {k1, k2, p1, p2, k3};
}

std::span<const Property<ViewportSettings>> viewport_properties() {
  static constexpr Property<S> table[] = {
      place_property<&S::eye_x, &S::eye_y, &S::eye_z>(
          "eye",
          "Place of the viewport's eye: eye-x, eye-y and eye-z at once, as in 1.15,1.5,2.75 "
          "(metres, -1e6 to 1e6)."),
      place_property<&S::target_x, &S::target_y, &S::target_z>(
          "target",
          "Point in the middle of the picture: target-x, target-y and target-z at once, as in "
          "0,0.98,0 (metres, -1e6 to 1e6)."),
      property<&S::eye_x>("eye-x", "Place of the viewport's eye, x, in scene metres (-1e6 to 1e6).",
                          -far, far),
      property<&S::eye_y>("eye-y", "Height (y) of the viewport's eye, in metres (-1e6 to 1e6).",
                          -far, far),
      property<&S::eye_z>("eye-z", "Place of the viewport's eye, z, in metres (-1e6 to 1e6).", -far,
                          far),
      property<&S::target_x>(
          "target-x", "Point in the middle of the picture, x, in metres (-1e6 to 1e6).", -far, far),
      property<&S::target_y>(
          "target-y", "Point in the middle of the picture, y, in metres (-1e6 to 1e6).", -far, far),
      property<&S::target_z>(
          "target-z", "Point in the middle of the picture, z, in metres (-1e6 to 1e6).", -far, far),
      property<&S::field_of_view>("field-of-view",
                                  "Angle from the lower to the upper edge of the picture, in "
                                  "degrees (1 to 170). A lens that distorts moves these edges.",
                                  1, 170),
      property<&S::key_frames>("key-frames",
                               "Path of a file of key frames (docs/viewport.md) by which the "
                               "viewport moves with stream time, in the place of eye, target and "
                               "field of view. Read again when it is written anew."),
      property<&S::k1>(
          "distortion-k1",
          "The lens's radial distortion: OpenCV's coefficient k1 (-10 to 10). Negative: barrel. It "
          "holds where neither a background's announcement nor a tracked camera tells the lens.",
          -10, 10),
      property<&S::k2>("distortion-k2", "As distortion-k1: OpenCV's k2.", -10, 10),
      property<&S::k3>("distortion-k3", "As distortion-k1: OpenCV's k3.", -10, 10),
      property<&S::p1>("distortion-p1",
                       "As distortion-k1: the tangential coefficient p1 of OpenCV.", -10, 10),
      property<&S::p2>("distortion-p2",
                       "As distortion-k1: the tangential coefficient p2 of OpenCV.", -10, 10),
  };
  return table;
}

std::span<const Property<ViewportSettings>> distortion_properties() {
  return viewport_properties().last(5);
}

const KeyFrames* ViewportKeyFrames::of(const std::string& path) {
  if (path.empty()) return nullptr;
  std::error_code none;
  const auto written = std::filesystem::last_write_time(path, none);
  if (path != path_ || written != written_ || (!keys_ && !why_)) {
    path_ = path;
    written_ = written;
    keys_.reset();
    why_.reset();
    try {
      keys_ = load_key_frames(path);
    } catch (const Error& error) {
      why_ = error;
    }
  }
  if (why_) throw *why_;
  return &*keys_;
}

std::string LensWatch::look(const Camera& viewport) {
  const bool same = viewport.distortion == last_.distortion && viewport.K == last_.K &&
                    viewport.width == last_.width && viewport.height == last_.height;
  if (same) return {};
  last_ = viewport;
  const double share = lost_share(viewport);
  if (std::exchange(lost_, share > most_lost) || !lost_) return {};
  return fmt::format(
      "The viewport's distortion is no lens's: it turns back within the picture, {:.0f} % of which "
      "it has no place for. There a background is left as it is, and scenesrc shows what it does "
      "at the rim of the rest. Look at distortion-k1 and on, or at what the background or its "
      "tracker announces.",
      100.0 * share);
}

Camera viewport_camera(const KeyFrames::View& view, int width, int height) {
  Camera camera = look_at(view.pose.eye, view.pose.target, view.field_of_view, width, height);
  if (view.shot > 0) camera.name += fmt::format(" {}", view.shot + 1);
  return camera;
}

bool navigate(GstEvent* event, ViewportControl& control, int height) {
  gdouble x = 0, y = 0, dx = 0, dy = 0;
  gint button = 0;
  const gchar* key = nullptr;
  switch (gst_navigation_event_get_type(event)) {
    case GST_NAVIGATION_EVENT_MOUSE_BUTTON_PRESS:
      if (gst_navigation_event_parse_mouse_button_event(event, &button, &x, &y))
        control.press(button, x, y);
      return false;
    case GST_NAVIGATION_EVENT_MOUSE_BUTTON_RELEASE:
      if (gst_navigation_event_parse_mouse_button_event(event, &button, &x, &y))
        control.release(button);
      return false;
    case GST_NAVIGATION_EVENT_MOUSE_MOVE:
      return gst_navigation_event_parse_mouse_move_event(event, &x, &y) &&
             control.move(x, y, height);
    case GST_NAVIGATION_EVENT_MOUSE_SCROLL:
      return gst_navigation_event_parse_mouse_scroll_event(event, &x, &y, &dx, &dy) &&
             control.wheel(dy > 0   ? 1.0
                           : dy < 0 ? -1.0
                                    : 0.0);
    case GST_NAVIGATION_EVENT_KEY_PRESS:
      return gst_navigation_event_parse_key_event(event, &key) && key != nullptr &&
             control.key(key);
    default:
      return false;
  }
}

}  // namespace polyhull::element
