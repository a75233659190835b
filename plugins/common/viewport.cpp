// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/viewport.h"

#include <gst/video/navigation.h>

namespace polyhull::element {

std::vector<double> ViewportSettings::distortion() const {
  if (k1 == 0.0 && k2 == 0.0 && k3 == 0.0 && p1 == 0.0 && p2 == 0.0) return {};
  return {k1, k2, p1, p2, k3};
}

std::span<const Property<ViewportSettings>> viewport_properties() {
  using S = ViewportSettings;
  constexpr double far = 1e6;
  static constexpr Property<S> table[] = {
      property<&S::eye_x>("eye-x", "Eye x",
                          "Place of the viewport's eye, x, in scene metres (-1e6 to 1e6).", -far,
                          far),
      property<&S::eye_y>("eye-y", "Eye y",
                          "Height (y) of the viewport's eye, in metres (-1e6 to 1e6).", -far, far),
      property<&S::eye_z>("eye-z", "Eye z",
                          "Place of the viewport's eye, z, in metres (-1e6 to 1e6).", -far, far),
      property<&S::target_x>("target-x", "Target x",
                             "Point in the middle of the picture, x, in metres (-1e6 to 1e6).",
                             -far, far),
      property<&S::target_y>("target-y", "Target y",
                             "Point in the middle of the picture, y, in metres (-1e6 to 1e6).",
                             -far, far),
      property<&S::target_z>("target-z", "Target z",
                             "Point in the middle of the picture, z, in metres (-1e6 to 1e6).",
                             -far, far),
      property<&S::field_of_view>("field-of-view", "Field of view",
                                  "Angle from the lower to the upper edge of the picture, in "
                                  "degrees (1 to 170). A lens that "
                                  "distorts moves these edges.",
                                  1, 170),
      property<&S::k1>(
          "distortion-k1", "Distortion k1",
          "The lens's radial distortion: OpenCV's coefficient k1 (-10 to 10). Negative: "
          "barrel. It holds where neither a background's announcement nor a tracked "
          "camera tells the lens.",
          -10, 10),
      property<&S::k2>("distortion-k2", "Distortion k2", "As distortion-k1: OpenCV's k2.", -10, 10),
      property<&S::k3>("distortion-k3", "Distortion k3", "As distortion-k1: OpenCV's k3.", -10, 10),
      property<&S::p1>("distortion-p1", "Distortion p1",
                       "As distortion-k1: the tangential coefficient p1 of OpenCV.", -10, 10),
      property<&S::p2>("distortion-p2", "Distortion p2",
                       "As distortion-k1: the tangential coefficient p2 of OpenCV.", -10, 10),
  };
  return table;
}

std::span<const Property<ViewportSettings>> distortion_properties() {
  return viewport_properties().last(5);
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
