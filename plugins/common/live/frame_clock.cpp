// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/live/frame_clock.h"

#include <algorithm>

#include "plugins/common/log.h"

namespace polyhull::element {
namespace {

constexpr std::int64_t least_change =
    5'000'000;  // changes of latency below it are not worth a message

}  // namespace

void FrameClock::reset() {
  const std::scoped_lock lock(mutex_);
  schedule_ = {};
  unsynced_ = true;
  grids_.reset();
  lateness_.reset();
  reported_ = 0;
}

std::int64_t FrameClock::running_time_of(std::uint64_t number) const {
  const guint64 time =
      gst_segment_to_running_time(&source_->segment, GST_FORMAT_TIME, schedule_.time_of(number));
  return GST_CLOCK_TIME_IS_VALID(time) ? static_cast<std::int64_t>(time) : no_time;
}

void FrameClock::set_rate(int numerator, int denominator) {
  const std::scoped_lock lock(mutex_);
  schedule_.set_rate(numerator, denominator);
}

bool FrameClock::seek(GstSegment* segment) {
  if (segment->rate < 0.0) {
    GST_CAT_WARNING_OBJECT(category_of(source_), source_, "Playing backwards is not supported.");
    return false;
  }
  segment->time = segment->start;
  const std::scoped_lock lock(mutex_);
  grids_.reset();  // running time may be set back
  lateness_.reset();
  if (schedule_.first()) {
    clock_.reset();
  } else {
    clock_.flushed();
  }
  schedule_.seek(segment->position);
  return true;
}

void FrameClock::set_delay(const Delay& delay) {
  bool changed = false;
  {
    const std::scoped_lock lock(mutex_);
    changed = delay.delay + delay.jitter != delay_.delay + delay_.jitter;
    delay_ = delay;
  }
  if (changed && gst_base_src_is_live(source_))
    gst_element_post_message(GST_ELEMENT_CAST(source_),
                             gst_message_new_latency(GST_OBJECT_CAST(source_)));
}

FrameClock::Frame FrameClock::next() {
  const bool live = gst_base_src_is_live(source_);
  const std::scoped_lock lock(mutex_);
  const Frame frame =
      schedule_.next(live ? clock_.now() : no_time, delay_.delay, live ? &grids_ : nullptr,
                     [this](std::uint64_t number) { return running_time_of(number); });
  if (frame.late > 0 || frame.unwanted > 0)
    GST_CAT_DEBUG_OBJECT(category_of(source_), source_,
                         "before frame %" G_GUINT64_FORMAT " %" G_GUINT64_FORMAT
                         " are left out as late, %" G_GUINT64_FORMAT " as unwanted downstream",
                         frame.number, frame.late, frame.unwanted);
  return frame;
}

void FrameClock::finish(const Frame& frame, GstBuffer* buffer) {
  GST_BUFFER_PTS(buffer) = frame.time;
  GST_BUFFER_DTS(buffer) = GST_CLOCK_TIME_NONE;
  GST_BUFFER_DURATION(buffer) = frame.duration;
  GST_BUFFER_OFFSET(buffer) = frame.number;
  GST_BUFFER_OFFSET_END(buffer) = frame.number + 1;
  GST_CAT_LOG_OBJECT(category_of(source_), source_, "made %" GST_PTR_FORMAT, printed(buffer));
  const std::scoped_lock lock(mutex_);
  schedule_.finish(frame.number);
}

GstClockTime FrameClock::due(const Frame& frame) const {
  if (!gst_base_src_is_live(source_)) return GST_CLOCK_TIME_NONE;
  const std::scoped_lock lock(mutex_);
  const std::int64_t time = running_time_of(frame.number);
  return time == no_time ? GST_CLOCK_TIME_NONE
                         : static_cast<GstClockTime>(time + delay_.of(frame.number));
}

void FrameClock::get_times(GstBuffer* buffer, GstClockTime* begin, GstClockTime* end) {
  *begin = *end = GST_CLOCK_TIME_NONE;
  if (!gst_base_src_is_live(source_)) return;
  Frame frame;
  frame.number = GST_BUFFER_OFFSET(buffer);
  const GstClockTime leaves = due(frame);
  const std::int64_t now = running_time_now(GST_ELEMENT_CAST(source_));
  if (now != no_time && GST_CLOCK_TIME_IS_VALID(leaves))
    report(now, now - static_cast<std::int64_t>(leaves));
  // The first frame goes as it comes: where the base class waits for the first one, it shifts the
  // stamps of all.
  const std::scoped_lock lock(mutex_);
  if (std::exchange(unsynced_, false) || !GST_CLOCK_TIME_IS_VALID(leaves)) return;
  *begin = leaves;
  *end = leaves + GST_BUFFER_DURATION(buffer);
}

void FrameClock::report(std::int64_t now, std::int64_t late) {
  bool changed = false;
  {
    const std::scoped_lock lock(mutex_);
    if (!unsynced_ && clock_.now() != no_time) lateness_.add(now, std::max<std::int64_t>(late, 0));
    const std::int64_t latency = lateness_.largest(now).value_or(0);
    changed = std::abs(latency - reported_) > least_change;
    if (changed) reported_ = latency;
  }
  if (changed)
    gst_element_post_message(GST_ELEMENT_CAST(source_),
                             gst_message_new_latency(GST_OBJECT_CAST(source_)));
}

bool FrameClock::answer_latency(GstQuery* query) {
  const std::scoped_lock lock(mutex_);
  const auto least = static_cast<GstClockTime>(reported_) + delay_.delay + delay_.jitter;
  // Held up it leaves frames out, so there is no most.
  gst_query_set_latency(query, gst_base_src_is_live(source_), least, GST_CLOCK_TIME_NONE);
  return true;
}

bool FrameClock::hear(GstEvent* event) {
  PaceChange change;
  if (!parse_pace_event(event, change)) return false;
  const std::scoped_lock lock(mutex_);
  grids_.change(change.grid, change.from);
  return true;
}

}  // namespace polyhull::element
