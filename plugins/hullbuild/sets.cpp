// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "base/error.h"
#include "base/stopwatch.h"
#include "builtin/default_rig.h"
#include "plugins/hullbuild/private.h"

namespace polyhull::element {
namespace {

/// A machine may be busy for a moment: what has piled up then is soon done, and better late than
/// not.
constexpr std::int64_t a_moment = 100 * GST_MSECOND;

void post_dropped(HullBuild& self, const ViewDecision& set) {
  const GstClockTime time =
      set.time == no_time ? GST_CLOCK_TIME_NONE : static_cast<GstClockTime>(set.time);
  const bool live = GST_CLOCK_TIME_IS_VALID(gst_aggregator_get_latency(self.element));
  GstMessage* message = gst_message_new_qos(GST_OBJECT(self.element), live, time,
                                            GST_CLOCK_TIME_NONE, time, GST_CLOCK_TIME_NONE);
  gst_message_set_qos_stats(message, GST_FORMAT_BUFFERS, self.statistics.counter("sets"),
                            self.statistics.counter("sets-dropped-incomplete") +
                                self.statistics.counter("sets-dropped-few-cameras") +
                                self.statistics.counter("sets-overdue") +
                                self.statistics.counter("sets-refused"));
  gst_element_post_message(GST_ELEMENT_CAST(self.element), message);
}

/// The views to build from: the set's, and held ones of missing cameras.
std::vector<SetView> views_of(HullBuild& self, const Pads& pads, const ViewDecision& set,
                              const HullSettings& settings) {
  std::vector<SetView> views;
  for (const std::size_t i : set.heads)
    views.push_back({name_of(pads[i], state_of<HullPadState>(pads[i]).view->view()),
                     state_of<HullPadState>(pads[i]).view.get()});
  if (settings.missing_camera != MissingCamera::hold) return views;
  const std::int64_t hold = hold_time_of(settings, length_of(pads, set));
  for (std::size_t i = 0; i < pads.size(); ++i) {
    const HullPadState& state = state_of<HullPadState>(pads[i]);
    if (state.held == nullptr || std::binary_search(set.heads.begin(), set.heads.end(), i))
      continue;
    const View& held = state.held->view();
    const std::string name = name_of(pads[i], held);
    const bool fresh =
        set.time == no_time || state.held_time == no_time || set.time - state.held_time <= hold;
    const Camera* camera = self.stage.rig().find(name);
    if (std::any_of(views.begin(), views.end(),
                    [&](const SetView& view) { return view.camera == name; }))
      continue;
    if (!fresh || camera == nullptr || camera->width != held.width || camera->height != held.height)
      continue;
    views.push_back({name, state.held.get()});
    self.statistics.count("views-held");
  }
  return views;
}

/// Removes the set's views from the queues, keeping those that may be held.
void take_views(const Pads& pads, const ViewDecision& set, const HullSettings& settings) {
  for (const std::size_t i : set.heads) {
    HullPadState& state = state_of<HullPadState>(pads[i]);
    state.last_trigger = state.head.trigger;
    state.last_time = state.head.time;
    state.delivered = true;
    if (settings.missing_camera == MissingCamera::hold) {
      state.held = std::move(state.view);
      state.held_time = state.head.time;
    } else {
      state.held.reset();
    }
  }
  drop_fronts(pads, set.heads);
}

void set_time(HullBuild& self, GstBuffer* buffer, std::int64_t time) {
  GstSegment& segment = GST_AGGREGATOR_PAD(self.element->srcpad)->segment;
  const GstClockTime position =
      gst_segment_position_from_running_time(&segment, GST_FORMAT_TIME, clock_time(time));
  GST_BUFFER_PTS(buffer) = GST_CLOCK_TIME_IS_VALID(position) ? position : clock_time(time);
}

void stamp(HullBuild& self, const Pads& pads, const ViewDecision& set, GstBuffer* buffer) {
  const Arrival& first = state_of<HullPadState>(pads[set.heads.front()]).parsed;
  self.follow(first.segment);
  GST_BUFFER_DURATION(buffer) = GST_BUFFER_DURATION(first.buffer);
  if (set.time != no_time) set_time(self, buffer, set.time);
}

void load_changed_rig(HullBuild& self, const HullSettings& settings) {
  if (!self.rig_changed.exchange(false)) return;
  try {
    use_rig(self, settings);
    forget_shown(self);
    forget_contradictions(self);
  } catch (const Error& error) {
    if (settings.rig.empty()) throw;  // the former one is not that of the views
    self.statistics.warn(GST_ELEMENT_CAST(self.element), "rigs-refused",
                         fmt::format("The former rig stays in use: {}", error.what()));
  }
}

enum class Outcome { again, need_data, ended, made };

struct Step {
  Outcome outcome;
  GstBuffer* buffer = nullptr;
  std::int64_t time = no_time, interval = 0;  // of what was made, as note_pace() has them
  Stopwatch busy;                             // since it was begun
};

/// What became of an instant, for the pace: its views are as far apart as a view lasts, or, where
/// they do not say how long, as the instants before. Returns that, ns.
std::int64_t note_pace(HullBuild& self, const Pads& pads, const ViewDecision& set, bool lost) {
  if (set.time == no_time) return 0;
  std::int64_t interval = length_of(pads, set);
  if (interval <= 0) {
    if (self.last_time != no_time && set.time > self.last_time &&
        (self.interval == 0 || set.time - self.last_time < self.interval))
      self.interval = set.time - self.last_time;
    interval = self.interval;
  }
  self.last_time = set.time;
  for (const std::int64_t time : self.unexplained) self.pace.note(time, interval, true);
  self.unexplained.clear();
  self.pace.note(set.time, interval, lost);
  return interval;
}

/// Whether a camera that the set lacks has sent a later view: it has left this instant out.
bool later_views_wait(const Pads& pads, const ViewDecision& set) {
  for (std::size_t i = 0; i < pads.size(); ++i)
    if (state_of<HullPadState>(pads[i]).view != nullptr &&
        !std::binary_search(set.heads.begin(), set.heads.end(), i))
      return true;
  return false;
}

/// Notes that \p set lacks a camera. One that has left this instant out could not keep up; one that
/// is silent may be gone, and is judged when it sends again. More thinning than by two does not
/// mend a camera that leaves frames out.
void note_left_out(HullBuild& self, const Pads& pads, const ViewDecision& set) {
  if (self.pace.thins() || set.time == no_time) return;
  if (later_views_wait(pads, set)) {
    note_pace(self, pads, set, true);
  } else {
    self.unexplained.push_back(set.time);
  }
}

Step drop_set(HullBuild& self, const Pads& pads, const ViewDecision& set,
              const HullSettings& settings, const char* counter) {
  take_views(pads, set, settings);
  self.statistics.count(counter);
  for (const std::size_t i : set.heads) ++state_of<HullPadState>(pads[i]).given_up;
  post_dropped(self, set);
  return {Outcome::again};
}

/// Whether a live set comes when nobody can use it any more, and newer views wait.
bool is_overdue(HullBuild& self, const Pads& pads, const ViewDecision& set) {
  const std::int64_t now = self.timing.now();
  if (now == no_time || set.time == no_time) return false;
  if (self.pace.too_late(set.time)) return true;
  const Arrival& first = state_of<HullPadState>(pads[set.heads.front()]).parsed;
  const std::int64_t interval = std::max(first.end() - set.time, a_moment);
  if (now <= set.time + interval + self.timing.latency()) return false;
  return later_views_wait(pads, set) || std::any_of(pads.begin(), pads.end(), more_wait);
}

/// Once a camera has ended no set can be complete any more.
bool any_ended(const Pads& pads) {
  return std::any_of(pads.begin(), pads.end(),
                     [](GstAggregatorPad* pad) { return state_of<HullPadState>(pad).ended; });
}

/// Hands over \p buffer for \p set, whose views are done with.
Step finish(HullBuild& self, const Pads& pads, const ViewDecision& set,
            const HullSettings& settings, GstBuffer* buffer, const Stopwatch& watch) {
  const std::int64_t interval = note_pace(self, pads, set, false);
  stamp(self, pads, set, buffer);
  GST_LOG_OBJECT(self.element, "%s is built of %zu views in %.1f ms: %s%s: %" GST_PTR_FORMAT,
                 instant_text(pads, set).c_str(), self.stage.cameras().size(), watch.milliseconds(),
                 self.stage.is_empty() ? "an empty mesh" : "a mesh",
                 self.stage.is_reused() ? " used again" : "", printed(buffer));
  take_views(pads, set, settings);
  self.timing.note_work(watch.seconds());
  self.statistics.set("set-ms", watch.milliseconds());
  return {Outcome::made, buffer, set.time, interval, watch};
}

/// Of a live set that nobody wants any more, or that is too late, what comes of dropping it.
std::optional<Step> drop_late(HullBuild& self, const Pads& pads, const ViewDecision& set,
                              const HullSettings& settings) {
  if (!self.timing.live() || set.time == no_time) return std::nullopt;
  if (self.first_time == no_time) self.first_time = set.time;
  if (!self.pace.wanted(set.time)) {
    GST_DEBUG_OBJECT(self.element, "%s is left out: one in %" G_GUINT64_FORMAT " is asked for",
                     instant_text(pads, set).c_str(), self.statistics.counter("frame-step"));
    return drop_set(self, pads, set, settings, "sets-unwanted");
  }
  if (!is_overdue(self, pads, set)) return std::nullopt;
  GST_DEBUG_OBJECT(self.element, "%s is dropped at %s: too late for a latency of %.1f ms",
                   instant_text(pads, set).c_str(), time_text(self.timing.now()).c_str(),
                   1e-6 * static_cast<double>(self.timing.latency()));
  // Where a sink is what is late, whoever draws for it sets the pace.
  if (!self.pace.too_late(set.time)) note_pace(self, pads, set, true);
  return drop_set(self, pads, set, settings, "sets-overdue");
}

Step build_set(HullBuild& self, const Pads& pads, const ViewDecision& set,
               const HullSettings& settings) {
  GstElement* element = GST_ELEMENT_CAST(self.element);
  const Stopwatch watch;
  if (std::optional<Step> dropped = drop_late(self, pads, set, settings)) return *dropped;
  self.fade.pass(set.time);
  const std::vector<AbsentCamera> absent = absent_cameras(self, pads, set);
  self.words.absent(element, absent);
  if (!absent.empty() && must_be_whole(absent, settings, length_of(pads, set))) {
    GST_DEBUG_OBJECT(element, "%s is dropped by missing-camera=%s: it lacks %s",
                     instant_text(pads, set).c_str(), nick_of(settings.missing_camera),
                     list_of(absent, true).c_str());
    note_left_out(self, pads, set);
    const Step dropped = drop_set(self, pads, set, settings, "sets-dropped-incomplete");
    const bool over = settings.missing_camera == MissingCamera::drop_set && any_ended(pads);
    return over ? Step{Outcome::ended} : dropped;
  }
  std::vector<SetView> views = views_of(self, pads, set, settings);
  const std::size_t used = views.size();
  if (const std::string lack = find_lack(self, pads.size(), views, absent.empty(), settings);
      !lack.empty()) {
    GST_DEBUG_OBJECT(element, "%s is dropped by min-cameras: %s%s%s",
                     instant_text(pads, set).c_str(), lack.c_str(),
                     absent.empty() ? "" : "; it lacks ", list_of(absent, true).c_str());
    self.statistics.count("sets-dropped-few-cameras");
    self.words.hidden(element, set.time, lack, absent);
    post_dropped(self, set);
    if (GstBuffer* last = fading_set(self, views, settings))
      return finish(self, pads, set, settings, last, watch);
    take_views(pads, set, settings);
    return {Outcome::again};
  }
  const float opacity = self.fade.opacity();
  GstBuffer* buffer = build_views(self, views, settings, set.trigger, opacity);
  if (buffer == nullptr) {
    GST_DEBUG_OBJECT(element, "%s is dropped, as it cannot be built",
                     instant_text(pads, set).c_str());
    take_views(pads, set, settings);
    post_dropped(self, set);
    return {Outcome::again};
  }
  note_shown(self, views);
  self.statistics.count("sets-fading", opacity < 1.0f);
  // Who has been silent for this long is gone.
  if (!absent.empty()) {
    GST_DEBUG_OBJECT(element, "%s is built by missing-camera=%s without %s",
                     instant_text(pads, set).c_str(), nick_of(settings.missing_camera),
                     list_of(absent, true).c_str());
    self.statistics.count("sets-incomplete");
    self.unexplained.clear();
  }
  self.words.built(element, set.time, used, absent);
  note_repairs(self, pads, set.time);
  note_doubts(self, set.time);
  note_hull(self, set.time, used);
  note_times(self, pads, set, settings);
  return finish(self, pads, set, settings, buffer, watch);
}

/// Ends a fade that no set goes on with, else does \p otherwise.
Step settle(HullBuild& self, const HullSettings& settings, Outcome otherwise) {
  GstBuffer* buffer = settled_set(self, settings);
  if (buffer == nullptr) return {otherwise};
  const GstClockTime length = GST_BUFFER_DURATION(self.shown_views.front().buffer.get());
  GST_BUFFER_DURATION(buffer) = length;
  set_time(
      self, buffer,
      self.fade.time() + (GST_CLOCK_TIME_IS_VALID(length) ? static_cast<std::int64_t>(length) : 0));
  return {Outcome::made, buffer};
}

/// Views that came after their set had gone.
void count_late(HullBuild& self, const Pads& pads, const std::vector<std::size_t>& which,
                const HullSettings& settings) {
  self.statistics.count("views-late", which.size());
  const std::int64_t now = self.timing.now();
  for (const std::size_t i : which) ++state_of<HullPadState>(pads[i]).late;
  if (!self.timing.live() || now == no_time) return;
  const HullPadState& first = state_of<HullPadState>(pads[which.front()]);
  // In the first second nothing was known of the cameras.
  if (self.first_time == no_time || first.head.time < self.first_time + GST_SECOND) return;
  std::vector<CameraLateness> cameras;
  for (GstAggregatorPad* pad : pads) {
    const auto latest = state_of<LivePadState>(pad).punctuality.latest_of_all(now);
    if (latest)
      cameras.push_back({state_of<HullPadState>(pad).name, *latest, *latest > self.timing.limit()});
  }
  self.words.late(GST_ELEMENT_CAST(self.element), now, first.name, cameras, self.timing.wait(),
                  GST_CLOCK_TIME_IS_VALID(settings.max_wait));
  // What the wait can follow is no overload yet.
  const std::int64_t interval = first.parsed.end() - first.head.time;
  const bool hopeless = first.head.time != no_time && now - first.head.time > self.timing.wait() &&
                        now - first.head.time > self.timing.limit();
  if (hopeless) self.pace.note(first.head.time, interval, true);
}

/// Sets the properties that a GstController drives to their values at the stream time of the front
/// of \p pad.
void sync_controlled_properties(HullBuild& self, GstAggregatorPad* pad) {
  const GstClockTime stream = state_of<HullPadState>(pad).parsed.stream_time();
  if (GST_CLOCK_TIME_IS_VALID(stream)) gst_object_sync_values(GST_OBJECT(self.element), stream);
}

Step next_step(HullBuild& self, const Pads& pads, bool deadline_passed) {
  std::vector<ViewHead> heads;
  for (GstAggregatorPad* pad : pads) heads.push_back(look_at(self, pad));
  const HullSettings settings = snapshot(self.element, self.settings);
  note_told_rigs(self, pads, settings);
  load_changed_rig(self, settings);
  if (!check_cameras(self, pads)) return {Outcome::again};
  const ViewDecision decision =
      self.sets.next(heads, static_cast<std::int64_t>(settings.sync_tolerance), deadline_passed);
  using Kind = ViewDecision::Kind;
  switch (decision.kind) {
    case Kind::wait:
      GST_LOG_OBJECT(self.element, "waits for %s", waiting_text(pads, heads).c_str());
      return deadline_passed ? settle(self, settings, Outcome::need_data)
                             : Step{Outcome::need_data};
    case Kind::end:
      return settle(self, settings, Outcome::ended);
    case Kind::set:
      sync_controlled_properties(self, pads[decision.heads.front()]);
      return build_set(self, pads, decision, snapshot(self.element, self.settings));
    case Kind::drop_late:
      GST_DEBUG_OBJECT(self.element, "dropped, as their instant has gone: %s",
                       views_text(pads, decision.heads).c_str());
      count_late(self, pads, decision.heads, settings);
      break;
    case Kind::drop_duplicate:
      GST_DEBUG_OBJECT(self.element, "dropped, as they came twice: %s",
                       views_text(pads, decision.heads).c_str());
      self.statistics.count("views-duplicate", decision.heads.size());
      for (const std::size_t i : decision.heads) ++state_of<HullPadState>(pads[i]).duplicate;
      break;
    case Kind::drop_gaps:
      break;
  }
  drop_fronts(pads, decision.heads);
  return {Outcome::again};
}

/// A stream that starts anew may repeat numbers and times.
void forget_stream(HullBuild& self, GstAggregatorPad* pad) {
  HullPadState& state = state_of<HullPadState>(pad);
  const bool delivered = state.delivered;
  state.reset();
  state.delivered = delivered;  // it is still the camera that it was
  self.sets.reset();
  self.first_time = self.last_time = no_time;
  self.new_segment = true;
}

/// Whether what waits the longest has been waited for long enough.
bool is_due(HullBuild& self, const Pads& pads) {
  const std::int64_t now = self.timing.now();
  const std::int64_t deadline = next_deadline(self, pads);
  return now != no_time && deadline != no_time && now >= deadline;
}

}  // namespace

void forget_streams(HullBuild& self) {
  for (GstAggregatorPad* pad : Pads(self.element)) state_of<HullPadState>(pad).reset();
  self.sets.reset();
  forget_shown(self);
  self.fade.reset();
  {
    const std::scoped_lock lock(self.instants_mutex);
    self.instants.reset();
  }
  self.first_time = self.last_time = no_time;
  self.interval = 0;
  self.unexplained.clear();
}

void use_rig(HullBuild& self, const HullSettings& settings) {
  const bool told = settings.rig.empty() && !self.told_rig.empty();
  Rig rig =
      told ? parse_rig(self.told_rig, "the rig that came with the views") : open_rig(settings.rig);
  take_out_lost_lenses(GST_ELEMENT_CAST(self.element), rig);
  self.stage.set_rig(std::move(rig), !told && settings.rig.empty());
}

GstBuffer* build_views(HullBuild& self, std::vector<SetView> views, const HullSettings& settings,
                       std::uint64_t trigger, float opacity) {
  GstElement* element = GST_ELEMENT_CAST(self.element);
  try {
    return self.stage.build(element, std::move(views), settings, trigger,
                            settings.adaptive ? self.load.tolerance() : 0.0, opacity);
  } catch (const Error& error) {
    // One odd silhouette does not end the stream; what is wrong with the settings does.
    if (error.kind() != Error::Kind::unsupported) throw;
    self.statistics.warn(element, "sets-refused",
                         fmt::format("A set was dropped: {}", error.what()));
    return nullptr;
  }
}

GstFlowReturn send_next_set(HullBuild& self, bool timeout) {
  const LiveSettings settings = snapshot(self.element, self.settings).live();
  const bool live = self.live = self.keep_time(settings);
  self.start_wait = static_cast<std::int64_t>(
      GST_CLOCK_TIME_IS_VALID(settings.max_wait) ? 0 : settings.max_latency);
  Step step{Outcome::again};
  while (step.outcome == Outcome::again) {
    // The pads of this moment: what the others have must not be dropped past a camera that joins.
    const Pads pads(self.element);
    {
      const std::scoped_lock lock(self.instants_mutex);
      self.instants.keep_only(pads);
    }
    self.forget_flushed(pads, [&](GstAggregatorPad* pad) { forget_stream(self, pad); });
    step = next_step(self, pads, live ? is_due(self, pads) : timeout);
    // A deadline is that of the earliest front: once fronts are dropped it says nothing.
    timeout = false;
  }
  switch (step.outcome) {
    case Outcome::ended:
      return GST_FLOW_EOS;
    case Outcome::made: {
      const GstFlowReturn flow = gst_aggregator_finish_buffer(self.element, step.buffer);
      if (live)
        self.load.note(step.time, static_cast<std::int64_t>(1e9 * step.busy.seconds()),
                       step.interval);
      return flow;
    }
    default:
      return GST_AGGREGATOR_FLOW_NEED_DATA;
  }
}

}  // namespace polyhull::element
