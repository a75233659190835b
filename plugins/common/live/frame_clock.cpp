// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/live/frame_clock.h"

#include <algorithm>

namespace polyhull::element {
namespace {

constexpr std::int64_t steady = 5'000'000;  // changes of latency below it are not worth a message

/// A number that looks random, the same for the same arguments (splitmix64, Steele et al. 2014).
std::uint64_t scatter(std::uint64_t value) {
  value += 0x9E3779B97F4A7C15u;
  value = (value ^ (value >> 30)) * 0xBF58476D1CE4E5B9u;
  value = (value ^ (value >> 27)) * 0x94D049BB133111EBu;
  return value ^ (value >> 31);
}

}  // namespace

std::int64_t FrameClock::Delay::of(std::uint64_t number) const {
  if (jitter == 0) return static_cast<std::int64_t>(delay);
  const double unit = static_cast<double>(scatter(scatter(seed) + number) >> 11) * 0x1p-53;
  const auto moved = static_cast<std::int64_t>((2.0 * unit - 1.0) * static_cast<double>(jitter));
  return std::max<std::int64_t>(static_cast<std::int64_t>(delay) + moved, 0);
}

void FrameClock::reset() {
  const std::scoped_lock lock(mutex_);
  rate_n_ = 0;
  rate_d_ = 1;
  next_ = 0;
  sought_ = 0;
  first_ = unsynced_ = true;
  grids_.reset();
  lateness_.reset();
  reported_ = 0;
}

GstClockTime FrameClock::time_of(std::uint64_t number) const {
  return gst_util_uint64_scale(number, GST_SECOND * rate_d_, rate_n_);
}

std::int64_t FrameClock::running_time_of(std::uint64_t number) const {
  const guint64 time =
      gst_segment_to_running_time(&source_->segment, GST_FORMAT_TIME, time_of(number));
  return GST_CLOCK_TIME_IS_VALID(time) ? static_cast<std::int64_t>(time) : no_time;
}

void FrameClock::set_rate(int numerator, int denominator) {
  const std::scoped_lock lock(mutex_);
  const GstClockTime time = rate_n_ > 0 ? time_of(next_) : sought_;
  rate_n_ = numerator;
  rate_d_ = denominator;
  // The first frame that does not begin before.
  next_ = gst_util_uint64_scale(time, rate_n_, GST_SECOND * rate_d_);
  while (time_of(next_) < time) ++next_;
}

bool FrameClock::seek(GstSegment* segment) {
  if (segment->rate < 0.0) {
    GST_WARNING_OBJECT(source_, "Playing backwards is not supported.");
    return false;
  }
  segment->time = segment->start;
  const std::scoped_lock lock(mutex_);
  grids_.reset();  // running time may be set back
  lateness_.reset();
  if (first_) {
    clock_.reset();
  } else {
    clock_.flushed();
  }
  sought_ = segment->position;
  if (rate_n_ == 0) return true;
  // The frame that is on show then.
  next_ = gst_util_uint64_scale(sought_, rate_n_, GST_SECOND * rate_d_);
  if (time_of(next_ + 1) <= sought_) ++next_;
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
  const std::int64_t now = live ? clock_.now() : no_time;
  Frame frame;
  frame.number = next_;
  const std::int64_t begin = running_time_of(next_);
  if (now != no_time && begin != no_time) {
    const auto interval = static_cast<std::int64_t>(time_of(1));
    const std::int64_t behind = now - begin - static_cast<std::int64_t>(delay_.delay);
    // Half a frame at the start, when all sources still have the choice; later a whole one.
    if (behind > (first_ ? interval / 2 : interval)) {
      frame.late = static_cast<std::uint64_t>((behind + interval - 1) / interval);
      // To a number that others who are late meet, too.
      std::uint64_t step = 1;
      while (!first_ && step < frame.late && step < 8) step *= 2;
      frame.number = (next_ + frame.late + step - 1) / step * step;
      frame.late = frame.number - next_;
    }
  }
  if (live) {
    while (frame.unwanted < 64 && !grids_.wanted(running_time_of(frame.number))) {
      ++frame.number;
      ++frame.unwanted;
    }
  }
  if (first_) frame.late = 0;  // nobody has missed them
  frame.time = time_of(frame.number);
  frame.duration = time_of(frame.number + 1) - frame.time;
  return frame;
}

void FrameClock::finish(const Frame& frame, GstBuffer* buffer) {
  GST_BUFFER_PTS(buffer) = frame.time;
  GST_BUFFER_DTS(buffer) = GST_CLOCK_TIME_NONE;
  GST_BUFFER_DURATION(buffer) = frame.duration;
  GST_BUFFER_OFFSET(buffer) = frame.number;
  GST_BUFFER_OFFSET_END(buffer) = frame.number + 1;
  const std::scoped_lock lock(mutex_);
  next_ = frame.number + 1;
  first_ = false;
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
    changed = std::abs(latency - reported_) > steady;
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
