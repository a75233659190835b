// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/live/live_aggregator.h"

#include <algorithm>

namespace polyhull::element {

LiveAggregator::LiveAggregator(gpointer object, const char* statistics_name, InputWatch::In in)
    : element(GST_AGGREGATOR(object)),
      statistics(statistics_name),
      timing(element),
      pace(GST_ELEMENT_CAST(element), statistics),
      watch(GST_ELEMENT_CAST(element), in) {}

void LiveAggregator::add_interfaces(GType type) {
  static const GInterfaceInfo children{pads_as_children, nullptr, nullptr};
  g_type_add_interface_static(type, GST_TYPE_CHILD_PROXY, &children);
}

void LiveAggregator::begin(const LiveSettings& settings) {
  new_segment = true;
  timing.start(settings);
  pace.start();
  watch.start();
}

void LiveAggregator::end() {
  watch.stop();
  for (GstAggregatorPad* pad : Pads(element))
    gst_clear_buffer(&state_of<LivePadState>(pad).front.buffer);
}

bool LiveAggregator::keep_time(const LiveSettings& settings) {
  if (!timing.live()) return false;
  timing.update(settings);
  // What is only a little too late shall arrive here, to be counted and named.
  pace.set_patience(
      std::max({timing.limit(), timing.wait(), static_cast<std::int64_t>(settings.max_latency)}) +
      GST_SECOND);
  pace.tell_sources();
  return true;
}

void LiveAggregator::forget_flushed(const Pads& pads,
                                    const std::function<void(GstAggregatorPad*)>& forget) {
  bool any = false;
  for (GstAggregatorPad* pad : pads) {
    if (!state_of<LivePadState>(pad).flushed.exchange(false)) continue;
    forget(pad);
    any = true;
  }
  if (!any) return;
  timing.flushed();
  pace.start();  // running time may have been set back
}

void LiveAggregator::follow(const GstSegment& segment) {
  if (new_segment.exchange(false) && segment.format == GST_FORMAT_TIME)
    gst_aggregator_update_segment(element, &segment);
}

}  // namespace polyhull::element
