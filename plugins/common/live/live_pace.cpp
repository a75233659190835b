// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/live/live_pace.h"

#include <algorithm>
#include <utility>

#include "plugins/common/live/live_pad.h"

namespace polyhull::element {
namespace {

/// Sources draw up to a frame ahead: what they have begun they may finish.
constexpr std::int64_t lead = 100'000'000;

/// The longer of two grids; \p second where they are the same.
const FrameGrid& sparser(const FrameGrid& first, const FrameGrid& second) {
  return first.step > 1 && (second.step <= 1 || first.period() > second.period()) ? first : second;
}

}  // namespace

GstEvent* make_pace_event(const PaceChange& change) {
  return gst_event_new_custom(
      GST_EVENT_CUSTOM_UPSTREAM,
      gst_structure_new(pace_event_name, "anchor", G_TYPE_INT64, gint64{change.grid.anchor},
                        "interval", G_TYPE_INT64, gint64{change.grid.interval}, "step",
                        G_TYPE_INT64, gint64{change.grid.step}, "from", G_TYPE_INT64,
                        gint64{change.from}, "patience", G_TYPE_INT64, gint64{change.patience},
                        nullptr));
}

bool parse_pace_event(GstEvent* event, PaceChange& change) {
  if (!gst_event_has_name(event, pace_event_name)) return false;
  const GstStructure* fields = gst_event_get_structure(event);
  gint64 anchor = 0, interval = 0, step = 0, from = 0, patience = 0;
  if (!gst_structure_get(fields, "anchor", G_TYPE_INT64, &anchor, "interval", G_TYPE_INT64,
                         &interval, "step", G_TYPE_INT64, &step, "from", G_TYPE_INT64, &from,
                         "patience", G_TYPE_INT64, &patience, nullptr))
    return false;
  if (interval < 0 || step < 1) return false;
  change = {{anchor, interval, step}, from, patience};
  return true;
}

bool PaceFilter::hear(GstEvent* event) {
  PaceChange change;
  if (!parse_pace_event(event, change)) return false;
  const std::scoped_lock lock(mutex_);
  grids_.change(change.grid, change.from);
  patience_ = change.patience;
  return true;
}

bool PaceFilter::wanted(std::int64_t time, std::int64_t now) const {
  if (time == no_time) return true;
  const std::scoped_lock lock(mutex_);
  if (now != no_time && patience_ != INT64_MAX && now - time > patience_) return false;
  return grids_.wanted(time);
}

void PaceFilter::reset() {
  const std::scoped_lock lock(mutex_);
  grids_.reset();
  patience_ = INT64_MAX;
}

GstFlowReturn submit_wanted(GstBaseTransform* transform, const PaceFilter& pace,
                            Statistics& statistics, GstBaseTransformClass* parent,
                            gboolean discontinuous, GstBuffer* input) {
  const std::int64_t time = Arrival{input, transform->segment}.time();
  if (pace.wanted(time, running_time_now(GST_ELEMENT_CAST(transform))))
    return parent->submit_input_buffer(transform, discontinuous, input);
  statistics.count("frames-unwanted");
  gst_buffer_unref(input);
  return GST_BASE_TRANSFORM_FLOW_DROPPED;
}

LivePace::LivePace(GstElement* element, Statistics& statistics)
    : element_(element), statistics_(statistics) {}

void LivePace::start() {
  pace_.reset();
  earliest_ = INT64_MIN;
  const std::scoped_lock lock(mutex_);
  own_ = downstream_ = FrameGrid();
  grids_.reset();
  now_.grid = FrameGrid();
  now_.from = INT64_MIN;  // at once, whatever running time is from here on
  kept_ = INT64_MIN;
  ++version_;
  statistics_.set_count("frame-step", 1);
}

void LivePace::set_patience(std::int64_t patience) {
  const std::scoped_lock lock(mutex_);
  if (now_.patience == patience) return;
  now_.patience = patience;
  ++version_;
}

void LivePace::hear(GstEvent* event) {
  PaceChange change;
  if (parse_pace_event(event, change)) {
    const std::scoped_lock lock(mutex_);
    downstream_ = change.grid;
    const FrameGrid grid = sparser(own_, downstream_);
    if (grid == now_.grid) return;
    grids_.change(grid, change.from);
    now_.grid = grid;
    now_.from = change.from;
    ++version_;
    statistics_.set_count("frame-step", static_cast<std::uint64_t>(grid.step));
    return;
  }
  if (GST_EVENT_TYPE(event) != GST_EVENT_QOS) return;
  GstQOSType type;
  gdouble proportion = 0.0;
  GstClockTimeDiff late = 0;
  GstClockTime time = GST_CLOCK_TIME_NONE;
  gst_event_parse_qos(event, &type, &proportion, &late, &time);
  if (type == GST_QOS_TYPE_THROTTLE || !GST_CLOCK_TIME_IS_VALID(time) || late <= 0) return;
  earliest_ = static_cast<std::int64_t>(time) + late;
}

bool LivePace::wanted(std::int64_t time) const {
  const std::scoped_lock lock(mutex_);
  return grids_.wanted(time);
}

void LivePace::note(std::int64_t time, std::int64_t interval, bool lost) {
  if (interval <= 0) return;
  if (!lost) kept_ = time;
  if (!pace_.note(time, lost)) return;
  const std::int64_t now = running_time_now(element_);
  const std::scoped_lock lock(mutex_);
  // A camera that is slow by half has sent what was kept.
  own_ = {kept_ != INT64_MIN ? kept_ : time, interval, pace_.step()};
  const FrameGrid grid = sparser(own_, downstream_);
  if (grid == now_.grid) return;
  now_.grid = grid;
  now_.from = std::max(time, now != no_time ? now : time) + 2 * interval + lead;
  grids_.change(grid, now_.from);
  ++version_;
  statistics_.set_count("frame-step", static_cast<std::uint64_t>(grid.step));
}

void LivePace::tell_sources() {
  PaceChange change;
  std::uint64_t version = 0;
  {
    const std::scoped_lock lock(mutex_);
    change = now_;
    version = version_;
  }
  for (GstAggregatorPad* pad : Pads(element_)) {
    LivePadState& state = state_of<LivePadState>(pad);
    if (state.punctuality.last_arrival() == no_time) continue;  // nobody may be there yet
    if (std::exchange(state.told, version) != version)
      gst_pad_push_event(GST_PAD(pad), make_pace_event(change));
  }
}

}  // namespace polyhull::element
