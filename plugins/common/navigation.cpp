// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/navigation.h"

#include <gst/video/navigation.h>

namespace polyhull::element {

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
