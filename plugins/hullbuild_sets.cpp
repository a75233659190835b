// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <chrono>
#include <string>

#include "base/error.h"
#include "hullbuild_private.h"

namespace polyhull::element {
namespace {

void post_dropped(PolyhullHullBuild* self, const ViewDecision& set) {
  HullBuildState& priv = *self->priv;
  const GstClockTime time =
      set.time == no_time ? GST_CLOCK_TIME_NONE : static_cast<GstClockTime>(set.time);
  const bool live = GST_CLOCK_TIME_IS_VALID(gst_aggregator_get_latency(GST_AGGREGATOR(self)));
  GstMessage* message = gst_message_new_qos(GST_OBJECT(self), live, time, GST_CLOCK_TIME_NONE, time,
                                            GST_CLOCK_TIME_NONE);
  gst_message_set_qos_stats(message, GST_FORMAT_BUFFERS, priv.statistics.counter("sets"),
                            priv.statistics.counter("sets-dropped-incomplete") +
                                priv.statistics.counter("sets-dropped-few-cameras") +
                                priv.statistics.counter("sets-refused"));
  gst_element_post_message(GST_ELEMENT_CAST(self), message);
}

/// The views to build from: the set's, and held ones of missing cameras.
std::vector<SetView> views_of(PolyhullHullBuild* self, const Pads& pads, const ViewDecision& set,
                              const HullSettings& settings) {
  std::vector<SetView> views;
  for (const std::size_t i : set.heads)
    views.push_back(
        {name_of(pads[i], state_of(pads[i]).view->view()), state_of(pads[i]).view.get()});
  if (settings.missing_camera != MissingCamera::hold) return views;
  for (std::size_t i = 0; i < pads.size(); ++i) {
    const HullPadState& state = state_of(pads[i]);
    if (state.held == nullptr || std::binary_search(set.heads.begin(), set.heads.end(), i))
      continue;
    const View& held = state.held->view();
    const std::string name = name_of(pads[i], held);
    const bool fresh = set.time == no_time || state.held_time == no_time ||
                       set.time - state.held_time <= static_cast<std::int64_t>(settings.hold_time);
    const Camera* camera = self->priv->stage.rig().find(name);
    if (!fresh || camera == nullptr || camera->width != held.width || camera->height != held.height)
      continue;
    views.push_back({name, state.held.get()});
    self->priv->statistics.count("views-held");
  }
  return views;
}

/// Removes the set's views from the queues, keeping those that may be held.
void take_views(const Pads& pads, const ViewDecision& set, const HullSettings& settings) {
  for (const std::size_t i : set.heads) {
    HullPadState& state = state_of(pads[i]);
    state.last_trigger = state.head.trigger;
    state.last_time = state.head.time;
    if (settings.missing_camera == MissingCamera::hold) {
      state.held = std::move(state.view);
      state.held_time = state.head.time;
    } else {
      state.held.reset();
    }
  }
  drop_fronts(pads, set.heads);
}

void stamp(PolyhullHullBuild* self, const Pads& pads, const ViewDecision& set, GstBuffer* buffer) {
  GstAggregatorPad* pad = pads[set.heads.front()];
  if (self->priv->new_segment.exchange(false)) {
    GST_OBJECT_LOCK(pad);
    const GstSegment segment = pad->segment;
    GST_OBJECT_UNLOCK(pad);
    if (segment.format == GST_FORMAT_TIME)
      gst_aggregator_update_segment(GST_AGGREGATOR(self), &segment);
  }
  GST_BUFFER_DURATION(buffer) = GST_BUFFER_DURATION(state_of(pad).parsed);
  if (set.time == no_time) return;
  GstSegment& segment = GST_AGGREGATOR_PAD(GST_AGGREGATOR(self)->srcpad)->segment;
  const GstClockTime position =
      gst_segment_position_from_running_time(&segment, GST_FORMAT_TIME, set.time);
  GST_BUFFER_PTS(buffer) =
      GST_CLOCK_TIME_IS_VALID(position) ? position : static_cast<GstClockTime>(set.time);
}

/// Building takes time that a live sink must know of. Grows in steps, so that it changes rarely.
void account(PolyhullHullBuild* self, std::chrono::steady_clock::duration taken) {
  const GstClockTime time = std::chrono::nanoseconds(taken).count();
  self->priv->statistics.set("set-ms", time * 1e-6);
  if (time <= self->priv->processing) return;
  self->priv->processing = time + time / 2;
  update_latency(self);
}

void load_changed_rig(PolyhullHullBuild* self, const HullSettings& settings) {
  HullBuildState& priv = *self->priv;
  if (!priv.rig_changed.exchange(false)) return;
  try {
    priv.stage.set_rig(settings.rig.empty() ? default_rig() : load_rig(settings.rig));
  } catch (const Error& error) {
    priv.statistics.warn(GST_ELEMENT_CAST(self), "rigs-refused",
                         std::string("The former rig stays in use: ") + error.what());
  }
}

enum class Outcome { again, need_data, ended, dropped, made };

struct Step {
  Outcome outcome;
  GstBuffer* buffer = nullptr;
};

Step build_set(PolyhullHullBuild* self, const Pads& pads, const ViewDecision& set,
               const HullSettings& settings) {
  HullBuildState& priv = *self->priv;
  const auto begin = std::chrono::steady_clock::now();
  const bool complete = set.heads.size() == pads.size();
  if (!complete && settings.missing_camera == MissingCamera::drop_set) {
    take_views(pads, set, settings);
    priv.statistics.count("sets-dropped-incomplete");
    post_dropped(self, set);
    // Once a camera has ended no set can be complete any more.
    for (GstAggregatorPad* pad : pads)
      if (gst_aggregator_pad_is_eos(pad)) return {Outcome::ended};
    return {Outcome::dropped};
  }
  std::vector<SetView> views = views_of(self, pads, set, settings);
  if (views.size() < settings.min_cameras) {
    take_views(pads, set, settings);
    priv.statistics.warn(GST_ELEMENT_CAST(self), "sets-dropped-few-cameras",
                         "A set was dropped: of the " + std::to_string(settings.min_cameras) +
                             " views that min-cameras asks for it has " +
                             std::to_string(views.size()) +
                             ". Connect more cameras, or look for what keeps their views away.");
    post_dropped(self, set);
    return {Outcome::dropped};
  }
  if (!complete) priv.statistics.count("sets-incomplete");
  const HullParameters parameters{settings.weld_distance, settings.max_deviation, settings.unseen,
                                  settings.use_bounds, static_cast<int>(settings.threads)};
  GstBuffer* buffer = nullptr;
  try {
    buffer = priv.stage.build(GST_ELEMENT_CAST(self), std::move(views), parameters, set.trigger);
  } catch (const Error& error) {
    // One odd silhouette does not end the stream; what is wrong with the settings does.
    if (error.kind() != Error::Kind::unsupported) throw;
    take_views(pads, set, settings);
    priv.statistics.warn(GST_ELEMENT_CAST(self), "sets-refused",
                         std::string("A set was dropped: ") + error.what());
    post_dropped(self, set);
    return {Outcome::dropped};
  }
  stamp(self, pads, set, buffer);
  take_views(pads, set, settings);
  account(self, std::chrono::steady_clock::now() - begin);
  return {Outcome::made, buffer};
}

/// Sets the properties that a GstController drives to their values at the stream time of the front
/// of \p pad.
void sync_controlled_properties(PolyhullHullBuild* self, GstAggregatorPad* pad) {
  const GstClockTime time = GST_BUFFER_DTS_OR_PTS(state_of(pad).parsed);
  if (!GST_CLOCK_TIME_IS_VALID(time)) return;
  GST_OBJECT_LOCK(pad);
  const GstClockTime stream = pad->segment.format == GST_FORMAT_TIME
                                  ? gst_segment_to_stream_time(&pad->segment, GST_FORMAT_TIME, time)
                                  : GST_CLOCK_TIME_NONE;
  GST_OBJECT_UNLOCK(pad);
  if (GST_CLOCK_TIME_IS_VALID(stream)) gst_object_sync_values(GST_OBJECT(self), stream);
}

Step next_step(PolyhullHullBuild* self, const Pads& pads, bool deadline_passed) {
  HullBuildState& priv = *self->priv;
  std::vector<ViewHead> heads;
  for (GstAggregatorPad* pad : pads) heads.push_back(look_at(self, pad));
  const HullSettings settings = snapshot(self, priv.settings);
  load_changed_rig(self, settings);
  check_cameras(self, pads);
  const ViewDecision decision =
      priv.sets.next(heads, static_cast<std::int64_t>(settings.sync_tolerance), deadline_passed);
  using Kind = ViewDecision::Kind;
  switch (decision.kind) {
    case Kind::wait:
      return {Outcome::need_data};
    case Kind::end:
      return {Outcome::ended};
    case Kind::set:
      sync_controlled_properties(self, pads[decision.heads.front()]);
      return build_set(self, pads, decision, snapshot(self, priv.settings));
    case Kind::drop_late:
      priv.statistics.count("views-late", decision.heads.size());
      break;
    case Kind::drop_duplicate:
      priv.statistics.count("views-duplicate", decision.heads.size());
      break;
    case Kind::drop_gaps:
      break;
  }
  drop_fronts(pads, decision.heads);
  return {Outcome::again};
}

/// A stream that starts anew may repeat numbers and times.
void forget_flushed(PolyhullHullBuild* self, const Pads& pads) {
  for (GstAggregatorPad* pad : pads) {
    if (!state_of(pad).flushed.exchange(false)) continue;
    state_of(pad).reset();
    self->priv->sets.reset();
    self->priv->new_segment = true;
  }
}

}  // namespace

void update_latency(PolyhullHullBuild* self) {
  const GstClockTime wait = snapshot(self, self->priv->settings).max_wait;
  gst_aggregator_set_latency(GST_AGGREGATOR(self), wait + self->priv->processing,
                             GST_CLOCK_TIME_NONE);
}

void forget_streams(PolyhullHullBuild* self) {
  for (GstAggregatorPad* pad : Pads(self)) state_of(pad).reset();
  self->priv->sets.reset();
}

GstFlowReturn send_next_set(PolyhullHullBuild* self, bool deadline_passed) {
  Step step{Outcome::again};
  while (step.outcome == Outcome::again) {
    // The pads of this moment: what the others have must not be dropped past a camera that joins.
    const Pads pads(self);
    forget_flushed(self, pads);
    step = next_step(self, pads, deadline_passed);
    // A deadline is that of the earliest front: once fronts are dropped it says nothing.
    deadline_passed = false;
  }
  switch (step.outcome) {
    case Outcome::ended:
      return GST_FLOW_EOS;
    case Outcome::made:
      return gst_aggregator_finish_buffer(GST_AGGREGATOR(self), step.buffer);
    case Outcome::dropped:
      return GST_FLOW_OK;
    default:
      return GST_AGGREGATOR_FLOW_NEED_DATA;
  }
}

}  // namespace polyhull::element
