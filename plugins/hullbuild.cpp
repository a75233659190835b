// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// hullbuild: the exact polyhedral visual hull of several cameras' silhouettes. Each request pad
/// takes the views of one camera; views of one instant become one mesh, which also carries the
/// views (their pixels shared, not copied) for texturing. The mesh is closed, oriented and
/// 2-manifold.
///
/// Properties that matter: `rig`, the calibration; `missing-camera` and `max-wait`, what happens
/// when a camera falls out; on each pad `camera`, its name in the rig.
///
/// gst-launch-1.0 hullbuild name=hull ! fakesink
///     rigtestsrc camera=cam0 num-buffers=30 ! chromamatte ! gaussblur ! contourfind camera=cam0 !
///     hull. rigtestsrc camera=cam1 num-buffers=30 ! chromamatte ! gaussblur ! contourfind
///     camera=cam1 ! hull. rigtestsrc camera=cam2 num-buffers=30 ! chromamatte ! gaussblur !
///     contourfind camera=cam2 ! hull.
#include "hullbuild.h"

#include <gst/base/gstaggregator.h>

#include <algorithm>
#include <atomic>
#include <chrono>

#include "base/error.h"
#include "base/thread_pool.h"
#include "common/guard.h"
#include "common/hull_stage.h"
#include "hullbuild_pad.h"
#include "hullbuild_properties.h"

GST_DEBUG_CATEGORY_STATIC(hullbuild_debug);
#define GST_CAT_DEFAULT hullbuild_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

struct Private {
  HullSettings settings;  // under the object lock

  std::atomic<bool> rig_changed{false};
  std::atomic<bool> new_segment{true};
  std::atomic<GstClockTime> processing{0};  // part of the latency: what building has taken

  Statistics statistics{"hullbuild-stats"};  // the rest belongs to the source pad's thread
  HullStage stage{statistics};
  ViewSets sets;
};

struct PolyhullHullBuild {
  GstAggregator parent;
  Private* priv;
};

struct PolyhullHullBuildClass {
  GstAggregatorClass parent_class;
};

enum { first_setting = 1 };
guint force_live_id;
guint stats_id;

void child_proxy_init(gpointer interface, gpointer);
GType polyhull_hull_build_get_type();
G_DEFINE_TYPE_WITH_CODE(PolyhullHullBuild, polyhull_hull_build, GST_TYPE_AGGREGATOR,
                        G_IMPLEMENT_INTERFACE(GST_TYPE_CHILD_PROXY, child_proxy_init))

PolyhullHullBuild* self_of(gpointer object) {
  return static_cast<PolyhullHullBuild*>(object);
}
Private& private_of(gpointer object) {
  return *self_of(object)->priv;
}

// ---- properties

void update_latency(PolyhullHullBuild* self) {
  const GstClockTime wait = snapshot(self, self->priv->settings).max_wait;
  gst_aggregator_set_latency(GST_AGGREGATOR(self), wait + self->priv->processing,
                             GST_CLOCK_TIME_NONE);
}

void set_property_value(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  Private& priv = private_of(object);
  if (id == force_live_id) {
    gst_aggregator_set_force_live(GST_AGGREGATOR(object), g_value_get_boolean(value));
    return;
  }
  if (!set_property(object, hull_properties(), first_setting, priv.settings, id, value)) {
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
    return;
  }
  if (id == first_setting + rig_row) priv.rig_changed = true;
  if (id == first_setting + pool_row) set_pool_threads(static_cast<int>(g_value_get_uint(value)));
  update_latency(self_of(object));
}

void get_property_value(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  Private& priv = private_of(object);
  if (id == stats_id) {
    g_value_take_boxed(value, priv.statistics.structure());
  } else if (id == force_live_id) {
    g_value_set_boolean(value, gst_aggregator_get_force_live(GST_AGGREGATOR(object)));
  } else if (!get_property(object, hull_properties(), first_setting, priv.settings, id, value)) {
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  }
}

// ---- pads as children, for sink_0::camera

GObject* child_by_index(GstChildProxy* proxy, guint index) {
  GST_OBJECT_LOCK(proxy);
  gpointer pad = g_list_nth_data(GST_ELEMENT_CAST(proxy)->sinkpads, index);
  if (pad != nullptr) gst_object_ref(pad);
  GST_OBJECT_UNLOCK(proxy);
  return static_cast<GObject*>(pad);
}

guint children_count(GstChildProxy* proxy) {
  GST_OBJECT_LOCK(proxy);
  const guint count = GST_ELEMENT_CAST(proxy)->numsinkpads;
  GST_OBJECT_UNLOCK(proxy);
  return count;
}

void child_proxy_init(gpointer interface, gpointer) {
  auto* proxy = static_cast<GstChildProxyInterface*>(interface);
  proxy->get_child_by_index = child_by_index;
  proxy->get_children_count = children_count;
}

GstPad* request_new_pad(GstElement* element, GstPadTemplate* pad_template, const gchar* name,
                        const GstCaps* caps) {
  GstPad* pad = GST_ELEMENT_CLASS(polyhull_hull_build_parent_class)
                    ->request_new_pad(element, pad_template, name, caps);
  if (pad != nullptr)
    gst_child_proxy_child_added(GST_CHILD_PROXY(element), G_OBJECT(pad), GST_OBJECT_NAME(pad));
  return pad;
}

void release_pad(GstElement* element, GstPad* pad) {
  gst_child_proxy_child_removed(GST_CHILD_PROXY(element), G_OBJECT(pad), GST_OBJECT_NAME(pad));
  GST_ELEMENT_CLASS(polyhull_hull_build_parent_class)->release_pad(element, pad);
}

/// References on the sink pads as they are now.
class Pads {
 public:
  explicit Pads(gpointer element) {
    GST_OBJECT_LOCK(element);
    for (GList* l = GST_ELEMENT_CAST(element)->sinkpads; l != nullptr; l = l->next)
      pads_.push_back(GST_AGGREGATOR_PAD(gst_object_ref(l->data)));
    GST_OBJECT_UNLOCK(element);
  }
  ~Pads() {
    for (GstAggregatorPad* pad : pads_) gst_object_unref(pad);
  }
  Pads(const Pads&) = delete;
  Pads& operator=(const Pads&) = delete;
  std::size_t size() const { return pads_.size(); }
  GstAggregatorPad* operator[](std::size_t i) const { return pads_[i]; }
  auto begin() const { return pads_.begin(); }
  auto end() const { return pads_.end(); }

 private:
  std::vector<GstAggregatorPad*> pads_;
};

// ---- fronts of the queues

bool is_gap(GstBuffer* buffer) {
  return GST_BUFFER_FLAG_IS_SET(buffer, GST_BUFFER_FLAG_GAP) && gst_buffer_get_size(buffer) == 0;
}

std::string name_of(GstAggregatorPad* pad, const View& view) {
  std::string name = camera_property(pad);
  return name.empty() ? view.camera : name;
}

ViewHead head_of_gap(GstAggregatorPad* pad, GstBuffer* buffer) {
  ViewHead head;
  head.state = ViewHead::State::gap;
  const GstClockTime begin = GST_BUFFER_PTS(buffer);
  const GstClockTime length = GST_BUFFER_DURATION(buffer);
  head.time = running_time(pad, begin);
  head.gap_end = GST_CLOCK_TIME_IS_VALID(begin) && GST_CLOCK_TIME_IS_VALID(length)
                     ? running_time(pad, begin + length)
                     : head.time;
  return head;
}

ViewHead head_of_view(GstAggregatorPad* pad, GstBuffer* buffer) {
  HullPadState& state = state_of(pad);
  ViewHead head;
  head.state = ViewHead::State::view;
  head.trigger = state.view->view().trigger;
  head.time = running_time(
      pad, GST_BUFFER_PTS_IS_VALID(buffer) ? GST_BUFFER_PTS(buffer) : GST_BUFFER_DTS(buffer));
  head.repeated = head.trigger != no_trigger ? head.trigger == state.last_trigger
                                             : head.time != no_time && head.time == state.last_time;
  return head;
}

/// Parses the front of the pad's queue unless that has been done; drops what is no view.
ViewHead look_at(PolyhullHullBuild* self, GstAggregatorPad* pad) {
  HullPadState& state = state_of(pad);
  for (;;) {
    GstBuffer* buffer = gst_aggregator_pad_peek_buffer(pad);
    if (buffer == nullptr) {
      state.forget_front();
      ViewHead head;
      if (gst_aggregator_pad_is_eos(pad)) head.state = ViewHead::State::ended;
      return head;
    }
    if (buffer == state.parsed) {
      gst_buffer_unref(buffer);
      return state.head;
    }
    state.forget_front();
    if (is_gap(buffer)) {
      state.head = head_of_gap(pad, buffer);
      state.parsed = buffer;
      return state.head;
    }
    try {
      state.view = std::make_unique<ViewBuffer>(buffer);
      state.head = head_of_view(pad, buffer);
      state.parsed = buffer;
      return state.head;
    } catch (const Error& error) {
      gst_buffer_unref(buffer);
      gst_aggregator_pad_drop_buffer(pad);
      self->priv->statistics.warn(
          GST_ELEMENT_CAST(self), "views-unusable",
          std::string("A buffer on ") + GST_OBJECT_NAME(pad) + " was dropped: " + error.what());
    }
  }
}

void drop_fronts(const Pads& pads, const std::vector<std::size_t>& which) {
  for (const std::size_t i : which) {
    state_of(pads[i]).forget_front();
    gst_aggregator_pad_drop_buffer(pads[i]);
  }
}

/// Each pad with a view has a camera of the rig, of the right size, and no two have the same.
void check_cameras(PolyhullHullBuild* self, const Pads& pads) {
  std::vector<std::pair<std::string, const char*>> seen;
  for (GstAggregatorPad* pad : pads) {
    const HullPadState& state = state_of(pad);
    if (state.view == nullptr) continue;
    const View& view = state.view->view();
    const std::string name = name_of(pad, view);
    const std::string where = std::string("hullbuild's pad ") + GST_OBJECT_NAME(pad);
    if (name.empty())
      throw Error(Error::Kind::bad_input,
                  where +
                      " has no camera: neither its property camera nor its views name one. Set "
                      "camera=NAME on contourfind or " +
                      GST_OBJECT_NAME(pad) + "::camera=NAME here");
    for (const auto& [other, other_pad] : seen)
      if (other == name)
        throw Error(Error::Kind::bad_input, where + " and " + other_pad +
                                                " both bring views of camera \"" + name +
                                                "\". Each pad takes another camera");
    seen.emplace_back(name, GST_OBJECT_NAME(pad));
    self->priv->stage.check(where, name, view.width, view.height);
  }
}

// ---- sets

void post_dropped(PolyhullHullBuild* self, const ViewDecision& set, const char* counter) {
  Private& priv = *self->priv;
  priv.statistics.count(counter);
  const GstClockTime time =
      set.time == no_time ? GST_CLOCK_TIME_NONE : static_cast<GstClockTime>(set.time);
  const bool live = GST_CLOCK_TIME_IS_VALID(gst_aggregator_get_latency(GST_AGGREGATOR(self)));
  GstMessage* message = gst_message_new_qos(GST_OBJECT(self), live, time, GST_CLOCK_TIME_NONE, time,
                                            GST_CLOCK_TIME_NONE);
  gst_message_set_qos_stats(message, GST_FORMAT_BUFFERS, priv.statistics.counter("sets"),
                            priv.statistics.counter("sets-dropped-incomplete") +
                                priv.statistics.counter("sets-dropped-few-cameras"));
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
  Private& priv = *self->priv;
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
  Private& priv = *self->priv;
  const auto begin = std::chrono::steady_clock::now();
  const bool complete = set.heads.size() == pads.size();
  if (!complete && settings.missing_camera == MissingCamera::drop_set) {
    take_views(pads, set, settings);
    post_dropped(self, set, "sets-dropped-incomplete");
    // Once a camera has ended no set can be complete any more.
    for (GstAggregatorPad* pad : pads)
      if (gst_aggregator_pad_is_eos(pad)) return {Outcome::ended};
    return {Outcome::dropped};
  }
  std::vector<SetView> views = views_of(self, pads, set, settings);
  if (views.size() < settings.min_cameras) {
    take_views(pads, set, settings);
    post_dropped(self, set, "sets-dropped-few-cameras");
    return {Outcome::dropped};
  }
  if (!complete) priv.statistics.count("sets-incomplete");
  const HullParameters parameters{settings.weld_distance, settings.max_deviation, settings.unseen,
                                  settings.use_bounds, static_cast<int>(settings.threads)};
  GstBuffer* buffer =
      priv.stage.build(GST_ELEMENT_CAST(self), std::move(views), parameters, set.trigger);
  stamp(self, pads, set, buffer);
  take_views(pads, set, settings);
  account(self, std::chrono::steady_clock::now() - begin);
  return {Outcome::made, buffer};
}

Step next_step(PolyhullHullBuild* self, const Pads& pads, bool deadline_passed) {
  Private& priv = *self->priv;
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
      if (decision.time != no_time) gst_object_sync_values(GST_OBJECT(self), decision.time);
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

void forget_streams(PolyhullHullBuild* self) {
  for (GstAggregatorPad* pad : Pads(self)) state_of(pad).reset();
  self->priv->sets.reset();
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

GstFlowReturn aggregate(GstAggregator* aggregator, gboolean timeout) {
  PolyhullHullBuild* self = self_of(aggregator);
  return guarded(GST_ELEMENT_CAST(self), GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    const Pads pads(self);
    forget_flushed(self, pads);
    // A deadline is that of the earliest front: once fronts are dropped it says nothing.
    Step step = next_step(self, pads, timeout);
    while (step.outcome == Outcome::again) step = next_step(self, pads, false);
    switch (step.outcome) {
      case Outcome::ended:
        return GST_FLOW_EOS;
      case Outcome::made:
        return gst_aggregator_finish_buffer(aggregator, step.buffer);
      case Outcome::dropped:
        return GST_FLOW_OK;
      default:
        return GST_AGGREGATOR_FLOW_NEED_DATA;
    }
  });
}

/// Running time of the earliest view that waits; the base class adds the latency.
GstClockTime get_next_time(GstAggregator* aggregator) {
  std::int64_t earliest = no_time;
  for (GstAggregatorPad* pad : Pads(aggregator)) {
    GstBuffer* buffer = gst_aggregator_pad_peek_buffer(pad);
    if (buffer == nullptr) continue;
    const std::int64_t time =
        is_gap(buffer) ? no_time : running_time(pad, GST_BUFFER_DTS_OR_PTS(buffer));
    gst_buffer_unref(buffer);
    if (time != no_time && (earliest == no_time || time < earliest)) earliest = time;
  }
  if (earliest == no_time) return GST_CLOCK_TIME_NONE;
  // The time kept for building is not spent waiting.
  const auto processing = static_cast<std::int64_t>(private_of(aggregator).processing.load());
  return static_cast<GstClockTime>(std::max<std::int64_t>(earliest - processing, 0));
}

// ---- events and states

gboolean sink_event(GstAggregator* aggregator, GstAggregatorPad* pad, GstEvent* event) {
  if (GST_EVENT_TYPE(event) == GST_EVENT_SEGMENT) private_of(aggregator).new_segment = true;
  return GST_AGGREGATOR_CLASS(polyhull_hull_build_parent_class)->sink_event(aggregator, pad, event);
}

gboolean start(GstAggregator* aggregator) {
  PolyhullHullBuild* self = self_of(aggregator);
  Private& priv = *self->priv;
  return guarded(GST_ELEMENT_CAST(self), gboolean{FALSE}, [&]() -> gboolean {
    const HullSettings settings = snapshot(self, priv.settings);
    priv.rig_changed = false;
    priv.stage.set_rig(settings.rig.empty() ? default_rig() : load_rig(settings.rig));
    priv.statistics.reset();
    priv.processing = 0;
    priv.new_segment = true;
    forget_streams(self);
    update_latency(self);
    return TRUE;
  });
}

gboolean stop(GstAggregator* aggregator) {
  forget_streams(self_of(aggregator));
  private_of(aggregator).stage.reset();
  return TRUE;
}

void polyhull_hull_build_init(PolyhullHullBuild* self) {
  self->priv = new Private;
  self->priv->statistics.declare({"sets-incomplete", "sets-dropped-incomplete",
                                  "sets-dropped-few-cameras", "views-late", "views-duplicate",
                                  "views-held", "views-unusable", "rigs-refused"});
  update_latency(self);
}

void finalize(GObject* object) {
  delete self_of(object)->priv;
  G_OBJECT_CLASS(polyhull_hull_build_parent_class)->finalize(object);
}

void install_all_properties(GObjectClass* klass) {
  force_live_id = install_properties(klass, hull_properties(), first_setting);
  g_object_class_install_property(
      klass, force_live_id,
      g_param_spec_boolean(
          "force-live", "Force live mode",
          "Whether sets go out by their deadline even if no source is live, so that a silent input "
          "cannot stall the others. Can only be set when the element is made.",
          FALSE,
          static_cast<GParamFlags>(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS |
                                   G_PARAM_CONSTRUCT_ONLY)));
  stats_id = force_live_id + 1;
  g_object_class_install_property(
      klass, stats_id,
      statistics_property(
          "Counters since the start: sets (meshes sent), sets-incomplete, sets-dropped-…, views-…, "
          "empty-meshes, hulls-reused, predicates and exact-predicates; and of the last set "
          "cameras "
          "(with foreground), faces, vertices, triangles and the milliseconds each phase took."));
}

void polyhull_hull_build_class_init(PolyhullHullBuildClass* klass) {
  GST_DEBUG_CATEGORY_INIT(hullbuild_debug, "hullbuild", 0, "visual hulls from views");
  GObjectClass* object_class = G_OBJECT_CLASS(klass);
  object_class->set_property = set_property_value;
  object_class->get_property = get_property_value;
  object_class->finalize = finalize;
  install_all_properties(object_class);

  GstElementClass* element_class = GST_ELEMENT_CLASS(klass);
  gst_element_class_set_static_metadata(
      element_class, "Visual hull builder", "Generic/Video",
      "Builds the exact, closed polyhedral visual hull from the views of several cameras",
      "polyhull");
  element_class->request_new_pad = request_new_pad;
  element_class->release_pad = release_pad;
  GstCaps* sink_caps = gst_caps_from_string(view_caps);
  GstCaps* src_caps = gst_caps_from_string(mesh_caps);
  gst_element_class_add_pad_template(
      element_class, gst_pad_template_new_with_gtype("sink_%u", GST_PAD_SINK, GST_PAD_REQUEST,
                                                     sink_caps, hull_pad_type()));
  gst_element_class_add_pad_template(
      element_class, gst_pad_template_new_with_gtype("src", GST_PAD_SRC, GST_PAD_ALWAYS, src_caps,
                                                     GST_TYPE_AGGREGATOR_PAD));
  gst_caps_unref(sink_caps);
  gst_caps_unref(src_caps);
  gst_type_mark_as_plugin_api(hull_pad_type(), static_cast<GstPluginAPIFlags>(0));

  GstAggregatorClass* aggregator_class = GST_AGGREGATOR_CLASS(klass);
  aggregator_class->aggregate = aggregate;
  aggregator_class->get_next_time = get_next_time;
  aggregator_class->sink_event = sink_event;
  aggregator_class->start = start;
  aggregator_class->stop = stop;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(hullbuild, "hullbuild", GST_RANK_NONE, polyhull_hull_build_get_type())
