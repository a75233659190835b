// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/live/side_pad.h"

#include "plugins/common/log.h"

namespace polyhull::element {
namespace {

/// Whether what is linked to \p pad is live.
bool comes_live(GstPad* pad) {
  g_autoptr(GstQuery) latency = gst_query_new_latency();
  gboolean live = FALSE;
  if (gst_pad_peer_query(pad, latency)) gst_query_parse_latency(latency, &live, nullptr, nullptr);
  return live != FALSE;
}

}  // namespace

SidePad::SidePad() {
  gst_segment_init(&segment_, GST_FORMAT_UNDEFINED);
}

GstPad* SidePad::make_pad(GstPadTemplate* pad_template) {
  const std::scoped_lock lock(mutex_);
  if (pad_ != nullptr) return nullptr;
  pad_ = gst_pad_new_from_template(pad_template, GST_PAD_TEMPLATE_NAME_TEMPLATE(pad_template));
  gst_pad_set_element_private(pad_, this);
  gst_pad_set_chain_function(pad_, chain);
  gst_pad_set_event_function(pad_, event);
  gst_pad_set_query_function(pad_, query);
  gst_pad_set_activatemode_function(pad_, activate);
  return pad_;
}

void SidePad::forget_pad() {
  reset(true);
  const std::scoped_lock lock(mutex_);
  pad_ = nullptr;
}

GstPad* SidePad::linked_pad() const {
  const std::scoped_lock lock(mutex_);
  return linked_now() ? GST_PAD_CAST(gst_object_ref(pad_)) : nullptr;
}

bool SidePad::linked() const {
  const std::scoped_lock lock(mutex_);
  return linked_now();
}

void SidePad::unlock(bool unlocked) {
  const std::scoped_lock lock(mutex_);
  unlocked_ = unlocked;
  changed_.notify_all();
}

bool SidePad::unlocked() const {
  const std::scoped_lock lock(mutex_);
  return unlocked_;
}

bool SidePad::push_upstream(GstEvent* event) {
  g_autoptr(GstPad) pad = linked_pad();
  if (pad != nullptr) return gst_pad_push_event(pad, event);
  gst_event_unref(event);
  return false;
}

std::optional<std::int64_t> SidePad::running_time(GstBuffer* buffer) const {
  GstClockTime time = GST_CLOCK_TIME_NONE;
  int sign = 0;
  if (segment_.format == GST_FORMAT_TIME && GST_BUFFER_PTS_IS_VALID(buffer))
    sign =
        gst_segment_to_running_time_full(&segment_, GST_FORMAT_TIME, GST_BUFFER_PTS(buffer), &time);
  if (sign == 0 || time > static_cast<GstClockTime>(G_MAXINT64 / 4)) return {};
  return sign * static_cast<std::int64_t>(time);
}

void SidePad::reset(bool flushing) {
  const std::scoped_lock lock(mutex_);
  flushing_ = flushing;
  live_ = ended_ = false;
  gst_segment_init(&segment_, GST_FORMAT_UNDEFINED);
  forget();
  changed_.notify_all();
}

/// Whether the event can be lived with.
bool SidePad::hear(GstPad* pad, GstEvent* event) {
  switch (GST_EVENT_TYPE(event)) {
    case GST_EVENT_FLUSH_START:
      reset(true);
      return true;
    case GST_EVENT_FLUSH_STOP:
      begin();
      reset(false);
      return true;
    case GST_EVENT_STREAM_START: {
      // Which comes at once, the segment with the first buffer.
      const bool live = comes_live(pad);
      const std::scoped_lock lock(mutex_);
      live_ = live;
      changed_.notify_all();
      return true;
    }
    case GST_EVENT_CAPS: {
      GstCaps* caps = nullptr;
      gst_event_parse_caps(event, &caps);
      return hear_caps(caps);
    }
    case GST_EVENT_SEGMENT: {
      const bool live = comes_live(pad);
      const std::scoped_lock lock(mutex_);
      gst_event_copy_segment(event, &segment_);
      live_ = live;
      ended_ = false;
      changed_.notify_all();
      return true;
    }
    case GST_EVENT_SEGMENT_DONE:  // nothing comes before another segment
    case GST_EVENT_EOS: {
      end();
      const std::scoped_lock lock(mutex_);
      ended_ = true;
      changed_.notify_all();
      return true;
    }
    default:
      return true;
  }
}

SidePad& SidePad::of(GstPad* pad) {
  return *static_cast<SidePad*>(gst_pad_get_element_private(pad));
}

GstFlowReturn SidePad::chain(GstPad* pad, GstObject*, GstBuffer* buffer) {
  GST_CAT_LOG_OBJECT(category_of(pad), pad, "%" GST_PTR_FORMAT " comes", printed(buffer));
  return of(pad).take(Ref<GstBuffer>(buffer));
}

gboolean SidePad::event(GstPad* pad, GstObject*, GstEvent* event) {
  const bool good = of(pad).hear(pad, event);
  gst_event_unref(event);
  return good;
}

/// Nothing of what comes here goes on into the stream of frames.
gboolean SidePad::query(GstPad* pad, GstObject* parent, GstQuery* query) {
  const bool caps =
      GST_QUERY_TYPE(query) == GST_QUERY_CAPS || GST_QUERY_TYPE(query) == GST_QUERY_ACCEPT_CAPS;
  return caps ? gst_pad_query_default(pad, parent, query) : FALSE;
}

gboolean SidePad::activate(GstPad* pad, GstObject*, GstPadMode mode, gboolean active) {
  if (mode != GST_PAD_MODE_PUSH) return FALSE;
  // The pad's thread is not within it before it is active; after, GStreamer waits for it.
  if (active) of(pad).begin();
  of(pad).reset(!active);
  return TRUE;
}

}  // namespace polyhull::element
