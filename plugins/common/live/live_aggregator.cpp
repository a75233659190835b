// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/live/live_aggregator.h"

namespace polyhull::element {

Pads::Pads(gpointer element) {
  const ObjectLock lock(element);
  for (GList* l = GST_ELEMENT_CAST(element)->sinkpads; l != nullptr; l = l->next)
    pads_.push_back(GST_AGGREGATOR_PAD(gst_object_ref(l->data)));
}

Pads::~Pads() {
  for (GstAggregatorPad* pad : pads_) gst_object_unref(pad);
}

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

void LiveAggregator::follow(const GstSegment& segment) {
  if (new_segment.exchange(false) && segment.format == GST_FORMAT_TIME)
    gst_aggregator_update_segment(element, &segment);
}

}  // namespace polyhull::element
