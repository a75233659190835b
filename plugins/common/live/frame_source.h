// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the sources of synthetic video do alike: they open something with the state PAUSED, make
/// the frame that a FrameClock asks for, can be sought, and tell their latency.
#pragma once

#include <gst/base/gstpushsrc.h>
#include <gst/video/video.h>

#include "plugins/common/element.h"
#include "plugins/common/guard.h"
#include "plugins/common/live/frame_clock.h"

namespace polyhull::element {

/// What their states derive from. A State has besides: `void open(GstElement*)`, which may
/// throw; `void close(GstElement*)`; `refusal`, the start of the sentence that turns a format down;
/// and, where it wants other events, `bool take(GstBaseSrc*, GstEvent*)`.
struct FrameSource {
  explicit FrameSource(gpointer object);

  /// Takes over the format; false, and an error on \p source that begins with \p refusal, where it
  /// cannot be drawn.
  bool set_format(GstBaseSrc* source, GstCaps* caps, const char* refusal);
  /// Answers LATENCY and CONVERT; the rest goes on to \p parent.
  gboolean answer(GstBaseSrc* source, GstQuery* query, GstBaseSrcClass* parent);
  /// At the start of a stream: no format, frame 0.
  void start(GstElement* element);

  GstVideoInfo info;  // under the object lock
  FrameClock clock;
};

/// The virtual functions of an element whose State is a FrameSource.
template <class State>
void install_frame_source(gpointer klass) {
  // Not in GstBaseSrc::start, after whose failure the base class would post a second error that
  // says nothing.
  GST_ELEMENT_CLASS(klass)->change_state = [](GstElement* element, GstStateChange transition) {
    State& self = state_of<State>(element);
    const bool opens = transition == GST_STATE_CHANGE_READY_TO_PAUSED;
    if (opens && !guarded(element, false, [&] {
          self.open(element);
          return true;
        }))
      return GST_STATE_CHANGE_FAILURE;
    const GstStateChangeReturn result =
        GST_ELEMENT_CLASS(parent_class<State>())->change_state(element, transition);
    if (transition == GST_STATE_CHANGE_PAUSED_TO_READY ||
        (opens && result == GST_STATE_CHANGE_FAILURE))
      self.close(element);
    return result;
  };
  GstBaseSrcClass* source = GST_BASE_SRC_CLASS(klass);
  source->set_caps = [](GstBaseSrc* base, GstCaps* caps) -> gboolean {
    return state_of<State>(base).set_format(base, caps, State::refusal);
  };
  source->get_times = [](GstBaseSrc* base, GstBuffer* buffer, GstClockTime* begin,
                         GstClockTime* end) {
    state_of<State>(base).clock.get_times(buffer, begin, end);
  };
  source->is_seekable = [](GstBaseSrc*) -> gboolean { return TRUE; };
  source->do_seek = [](GstBaseSrc* base, GstSegment* segment) -> gboolean {
    return state_of<State>(base).clock.seek(segment);
  };
  source->query = [](GstBaseSrc* base, GstQuery* query) {
    return state_of<State>(base).answer(base, query, GST_BASE_SRC_CLASS(parent_class<State>()));
  };
  source->event = [](GstBaseSrc* base, GstEvent* event) -> gboolean {
    State& self = state_of<State>(base);
    if (self.clock.hear(event)) return TRUE;
    if constexpr (requires { self.take(base, event); }) {
      if (self.take(base, event)) return TRUE;
    }
    return GST_BASE_SRC_CLASS(parent_class<State>())->event(base, event);
  };
  gst_type_mark_as_plugin_api(type_of<State>(), static_cast<GstPluginAPIFlags>(0));
}

}  // namespace polyhull::element
