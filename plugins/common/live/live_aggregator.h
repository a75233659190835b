// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the aggregators do alike: live pads as children, when to stop waiting, the pace of the
/// sources, and the property `force-live`.
#pragma once

#include <gst/base/gstaggregator.h>

#include <atomic>
#include <functional>

#include "plugins/common/element.h"
#include "plugins/common/live/input_watch.h"
#include "plugins/common/live/live_pace.h"
#include "plugins/common/live/live_pad.h"
#include "plugins/common/live/live_timing.h"
#include "plugins/common/pads_as_children.h"

namespace polyhull::element {

/// What their states derive from. A State has besides `bool hear(GstAggregatorPad*, GstEvent*)` for
/// events from upstream, false where one cannot be accepted; and may have `gboolean
/// navigate(GstEvent*)`, which takes the reference, `void hear_load(GstEvent*)`, which looks at each
/// event from downstream, and `bool answer(GstQuery*)` for queries from there.
struct LiveAggregator {
  LiveAggregator(gpointer object, const char* statistics_name,
                 InputWatch::In in = InputWatch::In::all_streams);
  static GType base_type() { return GST_TYPE_AGGREGATOR; }
  static void add_interfaces(GType type);

  /// At the start of the stream.
  void begin(const LiveSettings& settings);
  /// At its end.
  void end();
  /// Before each look at the inputs: learns how long to wait and tells the sources the pace. False:
  /// the stream is not live.
  bool keep_time(const LiveSettings& settings);
  /// Calls \p forget with each of the pads that was flushed.
  void forget_flushed(const Pads& pads, const std::function<void(GstAggregatorPad*)>& forget);
  /// Follows the first segment that is known, once for each new one.
  void follow(const GstSegment& segment);

  GstAggregator* element;
  std::atomic<bool> new_segment{true};
  Statistics statistics;
  LiveTiming timing;
  LivePace pace;
  InputWatch watch;
};

/// The property `force-live`.
template <class State>
void add_force_live(gpointer klass, const char* blurb) {
  const auto flags =
      static_cast<GParamFlags>(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | G_PARAM_CONSTRUCT_ONLY);
  add_property<State>(
      klass, g_param_spec_boolean("force-live", "Force live mode", blurb, FALSE, flags),
      {[](gpointer object, const GValue* value) {
         gst_aggregator_set_force_live(GST_AGGREGATOR(object), g_value_get_boolean(value));
       },
       [](gpointer object, GValue* value) {
         g_value_set_boolean(value, gst_aggregator_get_force_live(GST_AGGREGATOR(object)));
       }});
}

/// The virtual functions of an element whose State is a LiveAggregator.
template <class State>
void install_live_aggregator(gpointer klass) {
  GstElementClass* element_class = GST_ELEMENT_CLASS(klass);
  element_class->request_new_pad = [](GstElement* element, GstPadTemplate* pad_template,
                                      const gchar* name, const GstCaps* caps) {
    GstPad* pad = GST_ELEMENT_CLASS(parent_class<State>())
                      ->request_new_pad(element, pad_template, name, caps);
    if (pad == nullptr) return pad;
    GST_CAT_DEBUG_OBJECT(category_of(element), pad, "is requested");
    gst_child_proxy_child_added(GST_CHILD_PROXY(element), G_OBJECT(pad), GST_OBJECT_NAME(pad));
    return pad;
  };
  element_class->release_pad = [](GstElement* element, GstPad* pad) {
    GST_CAT_DEBUG_OBJECT(category_of(element), pad, "is released");
    gst_child_proxy_child_removed(GST_CHILD_PROXY(element), G_OBJECT(pad), GST_OBJECT_NAME(pad));
    GST_ELEMENT_CLASS(parent_class<State>())->release_pad(element, pad);
  };
  GstAggregatorClass* aggregator_class = GST_AGGREGATOR_CLASS(klass);
  aggregator_class->sink_event = [](GstAggregator* aggregator, GstAggregatorPad* pad,
                                    GstEvent* event) -> gboolean {
    // Whoever begins here has not heard of the pace.
    if (GST_EVENT_TYPE(event) == GST_EVENT_SEGMENT) state_of<LivePadState>(pad).told = 0;
    if (!state_of<State>(aggregator).hear(pad, event)) {
      gst_event_unref(event);
      return FALSE;
    }
    return GST_AGGREGATOR_CLASS(parent_class<State>())->sink_event(aggregator, pad, event);
  };
  aggregator_class->src_event = [](GstAggregator* aggregator, GstEvent* event) -> gboolean {
    State& self = state_of<State>(aggregator);
    self.pace.hear(event);
    if (gst_event_has_name(event, pace_event_name)) {
      gst_event_unref(event);
      return TRUE;
    }
    if constexpr (requires { self.hear_load(event); }) self.hear_load(event);
    if constexpr (requires { self.navigate(event); }) {
      if (GST_EVENT_TYPE(event) == GST_EVENT_NAVIGATION) return self.navigate(event);
    }
    return GST_AGGREGATOR_CLASS(parent_class<State>())->src_event(aggregator, event);
  };
  aggregator_class->src_query = [](GstAggregator* aggregator, GstQuery* query) -> gboolean {
    State& self = state_of<State>(aggregator);
    if constexpr (requires { self.answer(query); }) {
      if (self.answer(query)) return TRUE;
    }
    if (GST_QUERY_TYPE(query) == GST_QUERY_LATENCY) return self.timing.answer(query);
    return GST_AGGREGATOR_CLASS(parent_class<State>())->src_query(aggregator, query);
  };
}

}  // namespace polyhull::element
