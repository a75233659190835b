// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/live/live_pad.h"

#include "plugins/common/log.h"

namespace polyhull::element {

// ---- Arrival

std::int64_t Arrival::running_time(GstClockTime time) const {
  if (!GST_CLOCK_TIME_IS_VALID(time) || segment.format != GST_FORMAT_TIME) return no_time;
  const guint64 running = gst_segment_to_running_time(&segment, GST_FORMAT_TIME, time);
  return GST_CLOCK_TIME_IS_VALID(running) ? static_cast<std::int64_t>(running) + shift : no_time;
}

std::int64_t Arrival::end() const {
  const GstClockTime begin = GST_BUFFER_DTS_OR_PTS(buffer);
  const GstClockTime length = GST_BUFFER_DURATION(buffer);
  if (!GST_CLOCK_TIME_IS_VALID(begin) || !GST_CLOCK_TIME_IS_VALID(length)) return time();
  const std::int64_t end = running_time(begin + length);
  return end != no_time ? end : time();
}

GstClockTime Arrival::stream_time() const {
  const GstClockTime time = GST_BUFFER_DTS_OR_PTS(buffer);
  if (!GST_CLOCK_TIME_IS_VALID(time) || segment.format != GST_FORMAT_TIME)
    return GST_CLOCK_TIME_NONE;
  return gst_segment_to_stream_time(&segment, GST_FORMAT_TIME, time);
}

bool Arrival::gap() const {
  return GST_BUFFER_FLAG_IS_SET(buffer, GST_BUFFER_FLAG_GAP) && gst_buffer_get_size(buffer) == 0;
}

// ---- the pad

namespace {

/// The upstream thread's: a buffer is about to enter the queue.
GstPadProbeReturn buffer_comes(GstPad* pad, GstPadProbeInfo* info, gpointer) {
  LivePadState& state = state_of<LivePadState>(pad);
  GST_CAT_LOG_OBJECT(category_of(pad), pad, "%" GST_PTR_FORMAT " comes",
                     GST_PAD_PROBE_INFO_DATA(info));
  if (state.entry != nullptr) {
    const GstPadProbeReturn entered = state.entry(pad, info);
    if (entered != GST_PAD_PROBE_OK) return entered;
  }
  state.begun = true;
  ++state.queued;
  state.last_buffer = g_get_monotonic_time();
  state.said_silent = false;
  g_autoptr(GstElement) element = gst_pad_get_parent_element(pad);
  if (element == nullptr) return GST_PAD_PROBE_OK;
  const std::int64_t now = running_time_now(element);
  g_autoptr(GstEvent) event = gst_pad_get_sticky_event(pad, GST_EVENT_SEGMENT, 0);
  if (event == nullptr) return GST_PAD_PROBE_OK;
  Arrival arrival{GST_PAD_PROBE_INFO_BUFFER(info), {}};
  gst_event_copy_segment(event, &arrival.segment);
  const std::int64_t time = arrival.time();
  if (now != no_time && time != no_time) state.punctuality.note(now, time);
  return GST_PAD_PROBE_OK;
}

/// What upstream answers about latency. It has no upper bound here: the pad holds what has to
/// wait, whatever the sources can hold themselves. (With a bound below what is needed the base
/// class gives up with "clock problem" and waits for good.)
GstPadProbeReturn latency_answered(GstPad* pad, GstPadProbeInfo* info, gpointer) {
  GstQuery* query = GST_PAD_PROBE_INFO_QUERY(info);
  if (GST_QUERY_TYPE(query) != GST_QUERY_LATENCY) return GST_PAD_PROBE_OK;
  gboolean live = FALSE;
  GstClockTime least = 0, most = 0;
  gst_query_parse_latency(query, &live, &least, &most);
  if (!GST_CLOCK_TIME_IS_VALID(least)) least = 0;
  state_of<LivePadState>(pad).punctuality.note_reported(live ? static_cast<std::int64_t>(least)
                                                             : 0);
  gst_query_set_latency(query, live, least, GST_CLOCK_TIME_NONE);
  return GST_PAD_PROBE_OK;
}

GstFlowReturn flush(GstAggregatorPad* pad, GstAggregator*) {
  state_of<LivePadState>(pad).flushed = true;
  state_of<LivePadState>(pad).queued = 0;
  return GST_FLOW_OK;
}

}  // namespace

LivePadState::LivePadState(gpointer pad) {
  gst_pad_add_probe(GST_PAD(pad), GST_PAD_PROBE_TYPE_BUFFER, buffer_comes, nullptr, nullptr);
  gst_pad_add_probe(
      GST_PAD(pad),
      static_cast<GstPadProbeType>(GST_PAD_PROBE_TYPE_QUERY_UPSTREAM | GST_PAD_PROBE_TYPE_PULL),
      latency_answered, nullptr, nullptr);
}

void LivePadState::class_init(gpointer klass) {
  GST_AGGREGATOR_PAD_CLASS(klass)->flush = flush;
}

Pads::Pads(gpointer element) {
  const ObjectLock lock(element);
  for (GList* l = GST_ELEMENT_CAST(element)->sinkpads; l != nullptr; l = l->next)
    pads_.push_back(GST_AGGREGATOR_PAD(gst_object_ref(l->data)));
}

Pads::~Pads() {
  for (GstAggregatorPad* pad : pads_) gst_object_unref(pad);
}

const Arrival* peek(GstAggregatorPad* pad) {
  Arrival& front = state_of<LivePadState>(pad).front;
  GstBuffer* buffer = gst_aggregator_pad_peek_buffer(pad);
  gst_clear_buffer(&front.buffer);
  front = {buffer, snapshot(pad, pad->segment)};
  if (buffer != nullptr && front.gap()) front.shift = state_of<LivePadState>(pad).shift;
  return buffer != nullptr ? &front : nullptr;
}

void pop(GstAggregatorPad* pad) {
  LivePadState& state = state_of<LivePadState>(pad);
  const Arrival* first = peek(pad);
  if (first == nullptr) return;
  if (!first->gap() && state.queued > 0) --state.queued;
  gst_clear_buffer(&state.front.buffer);
  gst_aggregator_pad_drop_buffer(pad);
}

std::int64_t running_time_now(GstElement* element) {
  g_autoptr(GstClock) clock = gst_element_get_clock(element);
  if (clock == nullptr) return no_time;
  const GstClockTime now = gst_clock_get_time(clock);
  const GstClockTime base = gst_element_get_base_time(element);
  if (!GST_CLOCK_TIME_IS_VALID(now) || !GST_CLOCK_TIME_IS_VALID(base) || now < base) return no_time;
  return static_cast<std::int64_t>(now - base);
}

void FlushedClock::flushed() {
  base_at_flush_ = gst_element_get_base_time(element_);
  flush_time_ = g_get_monotonic_time();
}

std::int64_t FlushedClock::now() const {
  const bool known = base_at_flush_ != gst_element_get_base_time(element_) ||
                     g_get_monotonic_time() - flush_time_ > G_USEC_PER_SEC;
  return known ? running_time_now(element_) : no_time;
}

}  // namespace polyhull::element
