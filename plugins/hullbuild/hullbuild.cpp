// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// hullbuild: the exact polyhedral visual hull of several cameras' silhouettes. Each request pad
/// takes the views of one camera; views of one instant become one mesh, which also carries the
/// views (their pixels shared, not copied) for texturing. The mesh is closed, oriented and
/// 2-manifold.
#include <gst/base/gstaggregator.h>

#include <algorithm>

#include "base/thread_pool.h"
#include "plugins/common/guard.h"
#include "plugins/common/rig_event.h"
#include "plugins/hullbuild/private.h"

GST_DEBUG_CATEGORY(hullbuild_debug);

namespace polyhull::element {
namespace {

GstFlowReturn aggregate(GstAggregator* aggregator, gboolean timeout) {
  return guarded(GST_ELEMENT_CAST(aggregator), GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    return send_next_set(state_of<HullBuild>(aggregator), timeout);
  });
}

GstClockTime get_next_time(GstAggregator* aggregator) {
  HullBuild& self = state_of<HullBuild>(aggregator);
  const std::int64_t deadline = next_deadline(self, Pads(aggregator));
  return deadline == no_time ? GST_CLOCK_TIME_NONE : self.timing.wake_at(deadline);
}

/// The stream of \p pad brings the rig \p json from now on; empty: none, though it was \p recorded.
void note_rig(HullBuild& self, GstAggregatorPad* pad, const std::string& json, bool recorded) {
  HullPadState& state = state_of<HullPadState>(pad);
  state.kept_no_rig = recorded && json.empty();
  if (state.told_rig == json) return;
  state.told_rig = json;
  state.told_after = ++self.rigs_told;
}

gboolean start(GstAggregator* aggregator) {
  HullBuild& self = state_of<HullBuild>(aggregator);
  return guarded(GST_ELEMENT_CAST(aggregator), gboolean{FALSE}, [&]() -> gboolean {
    const HullSettings settings = snapshot(aggregator, self.settings);
    self.statistics.reset();
    for (GstAggregatorPad* pad : Pads(aggregator)) note_rig(self, pad, {}, false);
    self.told_rig.clear();
    self.rig_changed = self.rigs_differ = self.rig_assumed = false;
    use_rig(self, settings);
    self.words.reset();
    forget_contradictions(self);
    self.times.reset();
    self.load.reset();
    forget_streams(self);
    self.begin(settings.live());
    GST_DEBUG_OBJECT(
        aggregator,
        "starts with %zu cameras of rig '%s', missing-camera=%s, sync-tolerance %.1f ms",
        self.stage.rig().cameras.size(), settings.rig.c_str(), nick_of(settings.missing_camera),
        1e-6 * static_cast<double>(settings.sync_tolerance));
    return TRUE;
  });
}

gboolean stop(GstAggregator* aggregator) {
  HullBuild& self = state_of<HullBuild>(aggregator);
  self.end();
  forget_streams(self);
  self.stage.reset();
  return TRUE;
}

/// Adds what the camera \p name of \p pad has to tell at running time \p now.
void tell_camera(GstStructure* stats, GstAggregatorPad* pad, const std::string& name,
                 std::int64_t now) {
  const HullPadState& state = state_of<HullPadState>(pad);
  const auto tell = [&](const char* what, const std::atomic<std::uint64_t>& count) {
    gst_structure_set(stats, (what + name).c_str(), G_TYPE_UINT64, guint64{count.load()}, nullptr);
  };
  tell("late-views-", state.late);
  tell("duplicate-views-", state.duplicate);
  tell("early-views-", state.early);
  tell("unusable-views-", state.unusable);
  tell("given-up-views-", state.given_up);
  tell("clock-jumps-", state.jumps);
  tell("holes-filled-", state.holes_filled);
  tell("pieces-dropped-", state.pieces_dropped);
  const auto late = state_of<LivePadState>(pad).punctuality.latest_of_all(now);
  if (late)
    gst_structure_set(stats, ("lateness-ms-" + name).c_str(), G_TYPE_DOUBLE,
                      1e-6 * static_cast<double>(*late), nullptr);
}

}  // namespace

void note_told_rigs(HullBuild& self, const Pads& pads, const HullSettings& settings) {
  const HullPadState* last = nullptr;
  for (GstAggregatorPad* pad : pads) {
    const HullPadState& state = state_of<HullPadState>(pad);
    if (!state.told_rig.empty() && (last == nullptr || state.told_after > last->told_after))
      last = &state;
  }
  const std::string told = last ? last->told_rig : std::string();
  if (told != self.told_rig) {
    self.told_rig = told;
    if (settings.rig.empty()) self.rig_changed = true;
  }
  const bool differ = std::any_of(pads.begin(), pads.end(), [&](GstAggregatorPad* pad) {
    const HullPadState& state = state_of<HullPadState>(pad);
    return state.view && !state.told_rig.empty() && state.told_rig != told;
  });
  if (!std::exchange(self.rigs_differ, differ) && differ && settings.rig.empty())
    self.statistics.warn(
        GST_ELEMENT_CAST(self.element), "rigs-refused",
        "The views of two pads come with different rigs, as of two takes: the one that came last "
        "is used. Set rig to a file with all their cameras.");
  const bool assumed = told.empty() && settings.rig.empty() &&
                       std::any_of(pads.begin(), pads.end(), [&](GstAggregatorPad* pad) {
                         const HullPadState& state = state_of<HullPadState>(pad);
                         return state.view && state.kept_no_rig;
                       });
  if (!std::exchange(self.rig_assumed, assumed) && assumed)
    warn(
        GST_ELEMENT_CAST(self.element),
        "The take keeps no rig, so its cameras are taken for those of the built-in rig, which only "
        "rigtestsrc has. Set hullbuild's rig to the file of the cameras that it was recorded with; "
        "takesink rig=FILE keeps it in the next one.");
}

void note_times(HullBuild& self, const Pads& pads, const ViewDecision& set,
                const HullSettings& settings) {
  GstElement* element = GST_ELEMENT_CAST(self.element);
  std::vector<CameraTime> views;
  for (const std::size_t i : set.heads) {
    const HullPadState& state = state_of<HullPadState>(pads[i]);
    if (state.head.time != no_time) views.push_back({state.name, state.head.time});
  }
  TimeAxis axis = TimeAxis::running;
  bool of_files = false;
  {
    const std::scoped_lock lock(self.instants_mutex);
    axis = self.instants.axis();
    of_files = !self.timing.live() && !self.instants.any_told();
  }
  const bool by_trigger = std::all_of(set.heads.begin(), set.heads.end(), [&](std::size_t i) {
    return state_of<HullPadState>(pads[i]).head.trigger != no_trigger;
  });
  self.statistics.count(by_trigger                   ? "sets-by-trigger"
                        : axis == TimeAxis::timecode ? "sets-by-timecode"
                        : axis == TimeAxis::running  ? "sets-by-running-time"
                                                     : "sets-by-capture-time");
  const auto by = by_trigger                  ? SetTimes::By::trigger
                  : axis != TimeAxis::running ? SetTimes::By::capture_time
                  : of_files                  ? SetTimes::By::file_time
                                              : SetTimes::By::running_time;
  self.times.note(element, views, by, static_cast<std::int64_t>(settings.sync_tolerance));
  if (!self.times.due()) return;
  GstStructure* told = self.statistics_of(element);
  gst_structure_set_name(told, "polyhull-sets");
  gst_element_post_message(element, gst_message_new_element(GST_OBJECT(element), told));
}

HullBuild::HullBuild(gpointer object)
    : LiveAggregator(object, "hullbuild-stats", InputWatch::In::files) {
  statistics.declare({"sets-incomplete",
                      "sets-dropped-incomplete",
                      "sets-dropped-few-cameras",
                      "sets-fading",
                      "sets-refused",
                      "sets-overdue",
                      "sets-unwanted",
                      "sets-contradicted",
                      "sets-implausible",
                      "views-late",
                      "views-duplicate",
                      "views-early",
                      "views-held",
                      "views-unusable",
                      "clock-jumps",
                      "clocks-apart",
                      "clock-drifts",
                      "sets-by-trigger",
                      "sets-by-timecode",
                      "sets-by-capture-time",
                      "sets-by-running-time",
                      "rigs-refused",
                      "frame-step"});
}

void HullBuild::property_set(gpointer object, std::string_view name) {
  if (name == "force-live") return;
  const HullSettings now = snapshot(object, settings);
  if (name == "rig") rig_changed = true;
  if (name == "pool-threads") set_pool_threads(static_cast<int>(now.pool_threads));
  timing.update(now.live());
}

/// The counters, and for each camera how late its views come.
GstStructure* HullBuild::statistics_of(gpointer object) {
  GstStructure* stats = statistics.structure();
  timing.tell(stats);
  times.tell(stats);
  const std::int64_t now = running_time_now(GST_ELEMENT_CAST(object));
  for (GstAggregatorPad* pad : Pads(object)) {
    std::string name = snapshot(pad, state_of<HullPadState>(pad).name);
    if (name.empty()) name = GST_OBJECT_NAME(pad);
    tell_camera(stats, pad, name, now);
  }
  for (const auto& [pair, pixels] : snapshot(object, tangency_pixels))
    gst_structure_set(stats, ("tangency-px-" + pair).c_str(), G_TYPE_DOUBLE, pixels, nullptr);
  return stats;
}

bool HullBuild::hear(GstAggregatorPad* pad, GstEvent* event) {
  if (GST_EVENT_TYPE(event) == GST_EVENT_SEGMENT) new_segment = true;
  if (GST_EVENT_TYPE(event) == GST_EVENT_STREAM_START) note_rig(*this, pad, {}, false);
  if (const auto json = rig_of_event(event)) note_rig(*this, pad, *json, true);
  // At once, in the thread that brings the views: the next may come before the sets are looked at.
  if (GST_EVENT_TYPE(event) == GST_EVENT_FLUSH_STOP) {
    const std::scoped_lock lock(instants_mutex);
    instants.forget(pad);
  }
  return true;
}

void HullBuild::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(hullbuild_debug, "hullbuild", 0, "visual hulls from views");
  add_properties<HullBuild>(klass, hull_properties(), &HullBuild::settings);
  add_force_live<HullBuild>(
      klass,
      "Whether sets go out by their deadline even if no source is live, so that a silent input "
      "cannot stall the others. Can only be set when the element is made.");
  add_statistics<HullBuild>(
      klass,
      "Counters since the start: sets (meshes sent), sets-incomplete, sets-dropped-…, "
      "sets-fading (sent while the subject fades out or in), "
      "sets-overdue (came when nobody could use them), sets-unwanted (left out because not all "
      "can be done), views-…, "
      "empty-meshes, lone-silhouettes (one camera sees a foreground), full-silhouettes "
      "(foreground fills the frame), holes-filled and pieces-dropped (by repair; of each camera "
      "holes-filled-NAME and pieces-dropped-NAME), contradiction-percent (of the outlines in the "
      "last second's sets, what other cameras cut away), sets-contradicted (most cameras "
      "contradict each other: a wrong rig), sets-implausible (by the rig's unit no subject is so "
      "large, or no camera so near), tangency-px-ONE-OTHER (by how many pixels "
      "the outlines of two cameras lie beside each other where planes through both touch the "
      "subject, over .6 seconds) and tangency-px (the largest of these), rigs-refused (that cannot "
      "be used, or of one pad beside another's), hulls-reused, "
      "predicates and "
      "exact-predicates; and of the last set cameras (with foreground), subject-height-mm (along "
      "the rig's up, by its unit), faces, vertices, "
      "triangles, the milliseconds each phase took and threads-used (how many threads took part "
      "in its parallel loops, "
      "on average), and coarser-px, by how much adaptive moves contours. Live: wait-ms and "
      "latency-ms as they are now, frame-step (every how "
      "many instants one is asked for), and of each camera lateness-ms-NAME, the most that a "
      "view of the last ten seconds came after its instant. sets-by-trigger, "
      "sets-by-timecode, sets-by-capture-time and sets-by-running-time say what matched their "
      "views. Of the last hundred sets "
      "spread-minimum-us, spread-median-us and spread-maximum-us, the microseconds between a "
      "set's first and last view, and of each camera offset-us-NAME, by how much its views "
      "usually come after the middle of their sets. Views that were of no use, of each camera: "
      "late-views-NAME (their set had gone), duplicate-views-NAME, early-views-NAME (taken before "
      "the first set's time), unusable-views-NAME (no views, or not of their camera), "
      "given-up-views-NAME (their set was "
      "dropped); and clock-jumps-NAME. A message polyhull-sets on the bus has the same once a "
      "second, or every hundred sets.");
  set_metadata(klass, "Visual hull builder", "Generic/Video",
               "Builds the exact, closed polyhedral visual hull from the views of several cameras");
  add_template(klass, "sink_%u", GST_PAD_SINK, view_caps, type_of<HullPadState>(), GST_PAD_REQUEST);
  add_template(klass, "src", GST_PAD_SRC, mesh_caps, GST_TYPE_AGGREGATOR_PAD);
  gst_type_mark_as_plugin_api(type_of<HullPadState>(), static_cast<GstPluginAPIFlags>(0));
  install_live_aggregator<HullBuild>(klass);
  GstAggregatorClass* aggregator_class = GST_AGGREGATOR_CLASS(klass);
  aggregator_class->aggregate = aggregate;
  aggregator_class->get_next_time = get_next_time;
  aggregator_class->start = start;
  aggregator_class->stop = stop;
}

}  // namespace polyhull::element

using namespace polyhull::element;
GST_ELEMENT_REGISTER_DEFINE(hullbuild, "hullbuild", GST_RANK_NONE, type_of<HullBuild>())
