// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/live/live_pace.h"

#include <utility>

#include "plugins/common/live/live_pad.h"
#include "plugins/common/log.h"

namespace polyhull::element {

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

GstFlowReturn submit_wanted(GstBaseTransform* transform, const PaceFilter& pace,
                            Statistics& statistics, GstBaseTransformClass* parent,
                            gboolean discontinuous, GstBuffer* input) {
  const std::int64_t time = Arrival{input, transform->segment}.time();
  if (pace.wanted(time, running_time_now(GST_ELEMENT_CAST(transform))))
    return parent->submit_input_buffer(transform, discontinuous, input);
  statistics.count("frames-unwanted");
  GST_CAT_DEBUG_OBJECT(category_of(transform), transform,
                       "left out as unwanted downstream: %" GST_PTR_FORMAT, printed(input));
  gst_buffer_unref(input);
  return GST_BASE_TRANSFORM_FLOW_DROPPED;
}

void LivePace::start() {
  PaceKeeper::start();
  statistics_.set_count("frame-step", 1);
}

void LivePace::hear(GstEvent* event) {
  PaceChange change;
  if (parse_pace_event(event, change)) {
    PaceKeeper::hear(change);
    statistics_.set_count("frame-step", step());
    return;
  }
  if (GST_EVENT_TYPE(event) != GST_EVENT_QOS) return;
  GstQOSType type;
  gdouble proportion = 0.0;
  GstClockTimeDiff late = 0;
  GstClockTime time = GST_CLOCK_TIME_NONE;
  gst_event_parse_qos(event, &type, &proportion, &late, &time);
  if (type == GST_QOS_TYPE_THROTTLE || !GST_CLOCK_TIME_IS_VALID(time) || late <= 0) return;
  hear_earliest(static_cast<std::int64_t>(time) + late);
}

void LivePace::note(std::int64_t time, std::int64_t interval, bool lost) {
  PaceKeeper::note(running_time_now(element_), time, interval, lost);
  statistics_.set_count("frame-step", step());
}

void LivePace::tell_sources() {
  std::uint64_t version = 0;
  const PaceChange change = PaceKeeper::change(version);
  for (GstAggregatorPad* pad : Pads(element_)) {
    LivePadState& state = state_of<LivePadState>(pad);
    if (!state.punctuality.last_arrival()) continue;  // nobody may be there yet
    if (std::exchange(state.told, version) == version) continue;
    PaceChange theirs = change;
    theirs.grid.anchor -= state.shift;
    if (theirs.from != INT64_MIN) theirs.from -= state.shift;  // INT64_MIN: at once, on any clock
    GST_CAT_DEBUG_OBJECT(category_of(pad), pad,
                         "the source is asked for every frame in %" G_GUINT64_FORMAT, step());
    gst_pad_push_event(GST_PAD(pad), make_pace_event(theirs));
  }
}

}  // namespace polyhull::element
