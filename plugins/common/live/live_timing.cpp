// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/live/live_timing.h"

#include <algorithm>

#include "plugins/common/log.h"

namespace polyhull::element {
namespace {

constexpr std::int64_t ms = 1'000'000;
constexpr std::int64_t unknown_wait = 50 * ms;  // before anything has come
constexpr std::int64_t margin = 6 * ms;         // beyond the largest lateness seen
constexpr std::int64_t steady = 3 * ms;         // a latency that falls by less stays as it is

/// How much each pad takes beyond what has to wait, while the streaming thread is busy, before it
/// makes its camera wait. A camera that waits leaves frames out, others than its neighbours do.
constexpr std::int64_t spare_room = 250 * ms;

guint64 property_of(GstAggregator* element, const char* name) {
  guint64 value = 0;
  g_object_get(element, name, &value, nullptr);
  return value;
}

}  // namespace

LiveTiming::LiveTiming(GstAggregator* element)
    : element_(element), clock_(GST_ELEMENT_CAST(element)) {}

void LiveTiming::start(const LiveSettings& settings) {
  {
    const std::scoped_lock lock(mutex_);
    work_.reset();
    work_time_ = 0;
    held_ = 0;
    latency_ = 0;
    clock_.reset();
  }
  for (GstAggregatorPad* pad : Pads(element_)) {
    LivePadState& state = state_of<LivePadState>(pad);
    state.punctuality.reset();
    state.begun = false;
    state.last_buffer = g_get_monotonic_time();
  }
  update(settings);
}

bool LiveTiming::live() const {
  return GST_CLOCK_TIME_IS_VALID(gst_aggregator_get_latency(element_));
}

std::int64_t LiveTiming::reported_by_sources() const {
  std::int64_t reported = 0;
  for (GstAggregatorPad* pad : Pads(element_))
    reported = std::max(reported, state_of<LivePadState>(pad).punctuality.reported());
  return reported;
}

void LiveTiming::make_room(std::int64_t room) {
  if (room == room_) return;
  room_ = room;
  g_object_set(element_, "min-upstream-latency", static_cast<guint64>(room), nullptr);
  // The base class looks at it when it asks upstream.
  g_autoptr(GstQuery) query = gst_query_new_latency();
  answered_ = ask_base(query) || answered_;
}

void LiveTiming::update(const LiveSettings& settings) {
  const bool playing = live();
  if (!learn(settings, playing)) return;
  GST_CAT_DEBUG_OBJECT(category_of(element_), element_,
                       "waits %.1f ms for its inputs, and has a latency of %.1f ms",
                       1e-6 * static_cast<double>(wait()), 1e-6 * static_cast<double>(latency()));
  gst_element_post_message(GST_ELEMENT_CAST(element_),
                           gst_message_new_latency(GST_OBJECT_CAST(element_)));
}

bool LiveTiming::learn(const LiveSettings& settings, bool playing) {
  const std::scoped_lock lock(mutex_);
  const std::int64_t now = running_time_now(GST_ELEMENT_CAST(element_));
  const std::int64_t sources = reported_by_sources();
  extra_ = static_cast<std::int64_t>(property_of(element_, "latency"));
  const bool by_hand = GST_CLOCK_TIME_IS_VALID(settings.max_wait);
  const std::int64_t limit =
      sources + static_cast<std::int64_t>(by_hand ? settings.max_wait : settings.max_latency);
  limit_ = limit;
  make_room(playing ? limit + spare_room : 0);  // a file may wait
  // The latest input, and what the most punctual one needs beyond what its source says: the time of
  // the stages between.
  std::optional<std::int64_t> latest, stages;
  for (GstAggregatorPad* pad : Pads(element_)) {
    Punctuality& punctuality = state_of<LivePadState>(pad).punctuality;
    punctuality.set_limit(by_hand ? INT64_MAX : limit);
    const auto lateness = punctuality.latest(now);
    if (!lateness) continue;
    latest = std::max(latest.value_or(*lateness), *lateness);
    const std::int64_t beyond = *lateness - punctuality.reported();
    stages = std::min(stages.value_or(beyond), beyond);
  }
  if (by_hand) {
    wait_ = extra_ + limit + (stages.value_or(0) > 0 ? *stages + margin : 0);
  } else {
    wait_ = extra_ + std::clamp<std::int64_t>(latest ? *latest + margin : unknown_wait, 0, limit);
  }
  work_time_ = now != no_time ? work_.usually_largest(now).value_or(0) : 0;
  const std::int64_t latency = std::max(sources, wait_.load()) + work_time_ + held_;
  if (latency > latency_ || latency < latency_ - steady) {
    latency_ = latency;
    return true;
  }
  return false;
}

void LiveTiming::note_work(double seconds) {
  const std::int64_t now = running_time_now(GST_ELEMENT_CAST(element_));
  const std::scoped_lock lock(mutex_);
  if (now != no_time) work_.add(now, static_cast<std::int64_t>(1e9 * seconds));
}

void LiveTiming::tell(GstStructure* stats) const {
  gst_structure_set(stats, "wait-ms", G_TYPE_DOUBLE, 1e-6 * static_cast<double>(wait()),
                    "latency-ms", G_TYPE_DOUBLE, 1e-6 * static_cast<double>(latency()), nullptr);
}

bool LiveTiming::ask_base(GstQuery* query) {
  GstAggregatorClass* base = GST_AGGREGATOR_CLASS(g_type_class_peek(GST_TYPE_AGGREGATOR));
  return base->src_query(element_, query);
}

bool LiveTiming::answer(GstQuery* query) {
  if (!ask_base(query)) return false;
  answered_ = true;
  gboolean live = FALSE;
  gst_query_parse_latency(query, &live, nullptr, nullptr);
  const std::int64_t least = std::max(reported_by_sources(), wait_.load()) + work_time_ + held_;
  latency_ = std::max(latency_.load(), least);
  gst_query_set_latency(query, live, static_cast<GstClockTime>(latency_.load()),
                        GST_CLOCK_TIME_NONE);
  return true;
}

GstClockTime LiveTiming::wake_at(std::int64_t deadline) const {
  // Unsigned, and back where it was after the base class's addition.
  const std::int64_t sources = answered_ ? std::max(reported_by_sources(), room_.load()) : 0;
  const std::int64_t added = sources + extra_;
  return static_cast<GstClockTime>(std::max<std::int64_t>(deadline, 0) - added);
}

}  // namespace polyhull::element
