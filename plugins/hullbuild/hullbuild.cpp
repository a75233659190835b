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
#include "plugins/hullbuild/hullbuild.h"

#include <gst/base/gstaggregator.h>

#include "base/thread_pool.h"
#include "plugins/common/guard.h"
#include "plugins/common/pads_as_children.h"
#include "plugins/hullbuild/private.h"
#include "studio/cameras/default_rig.h"

GST_DEBUG_CATEGORY_STATIC(hullbuild_debug);
#define GST_CAT_DEFAULT hullbuild_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

struct PolyhullHullBuildClass {
  GstAggregatorClass parent_class;
};

enum { first_setting = 1 };
guint force_live_id;
guint stats_id;

GType polyhull_hull_build_get_type();
G_DEFINE_TYPE_WITH_CODE(PolyhullHullBuild, polyhull_hull_build, GST_TYPE_AGGREGATOR,
                        G_IMPLEMENT_INTERFACE(GST_TYPE_CHILD_PROXY, pads_as_children))

// ---- properties

void set_property_value(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  HullBuildState& priv = private_of(object);
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
  priv.timing.update(snapshot(object, priv.settings).live());
}

/// The counters, and for each camera how late its views come.
GstStructure* statistics_of(PolyhullHullBuild* self) {
  HullBuildState& priv = *self->priv;
  GstStructure* stats = priv.statistics.structure();
  gst_structure_set(stats, "wait-ms", G_TYPE_DOUBLE, 1e-6 * static_cast<double>(priv.timing.wait()),
                    "latency-ms", G_TYPE_DOUBLE,
                    1e-6 * static_cast<double>(priv.timing.latency()), nullptr);
  const std::int64_t now = running_time_now(GST_ELEMENT_CAST(self));
  for (GstAggregatorPad* pad : Pads(self)) {
    GST_OBJECT_LOCK(pad);
    std::string name = state_of(pad).name;
    GST_OBJECT_UNLOCK(pad);
    if (name.empty()) name = GST_OBJECT_NAME(pad);
    const auto late = live_state_of(pad).punctuality.latest_of_all(now);
    gst_structure_set(stats, ("late-views-" + name).c_str(), G_TYPE_UINT64,
                      static_cast<guint64>(state_of(pad).late.load()), nullptr);
    if (late)
      gst_structure_set(stats, ("lateness-ms-" + name).c_str(), G_TYPE_DOUBLE,
                        1e-6 * static_cast<double>(*late), nullptr);
  }
  return stats;
}

void get_property_value(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  HullBuildState& priv = private_of(object);
  if (id == stats_id) {
    g_value_take_boxed(value, statistics_of(self_of(object)));
  } else if (id == force_live_id) {
    g_value_set_boolean(value, gst_aggregator_get_force_live(GST_AGGREGATOR(object)));
  } else if (!get_property(object, hull_properties(), first_setting, priv.settings, id, value)) {
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  }
}

// ---- pads

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

// ---- data

GstFlowReturn aggregate(GstAggregator* aggregator, gboolean timeout) {
  PolyhullHullBuild* self = self_of(aggregator);
  return guarded(GST_ELEMENT_CAST(self), GST_FLOW_ERROR,
                 [&]() -> GstFlowReturn { return send_next_set(self, timeout); });
}

GstClockTime get_next_time(GstAggregator* aggregator) {
  PolyhullHullBuild* self = self_of(aggregator);
  const std::int64_t deadline = next_deadline(self, Pads(self));
  return deadline == no_time ? GST_CLOCK_TIME_NONE : self->priv->timing.wake_at(deadline);
}

// ---- events and states

gboolean sink_event(GstAggregator* aggregator, GstAggregatorPad* pad, GstEvent* event) {
  if (GST_EVENT_TYPE(event) == GST_EVENT_SEGMENT) {
    private_of(aggregator).new_segment = true;
    live_state_of(pad).told = 0;  // whoever begins here has not heard of the pace
  }
  return GST_AGGREGATOR_CLASS(polyhull_hull_build_parent_class)->sink_event(aggregator, pad, event);
}

gboolean src_event(GstAggregator* aggregator, GstEvent* event) {
  private_of(aggregator).pace.hear(event);
  if (gst_event_has_name(event, pace_event_name)) {
    gst_event_unref(event);
    return TRUE;
  }
  return GST_AGGREGATOR_CLASS(polyhull_hull_build_parent_class)->src_event(aggregator, event);
}

gboolean src_query(GstAggregator* aggregator, GstQuery* query) {
  if (GST_QUERY_TYPE(query) == GST_QUERY_LATENCY)
    return private_of(aggregator).timing.answer(query);
  return GST_AGGREGATOR_CLASS(polyhull_hull_build_parent_class)->src_query(aggregator, query);
}

gboolean start(GstAggregator* aggregator) {
  PolyhullHullBuild* self = self_of(aggregator);
  HullBuildState& priv = *self->priv;
  return guarded(GST_ELEMENT_CAST(self), gboolean{FALSE}, [&]() -> gboolean {
    const HullSettings settings = snapshot(self, priv.settings);
    priv.rig_changed = false;
    priv.stage.set_rig(open_rig(settings.rig));
    priv.statistics.reset();
    priv.new_segment = true;
    priv.words.reset();
    forget_streams(self);
    priv.timing.start(settings.live());
    priv.pace.start();
    priv.watch.start();
    return TRUE;
  });
}

gboolean stop(GstAggregator* aggregator) {
  private_of(aggregator).watch.stop();
  forget_streams(self_of(aggregator));
  private_of(aggregator).stage.reset();
  return TRUE;
}

void polyhull_hull_build_init(PolyhullHullBuild* self) {
  self->priv = new HullBuildState(GST_AGGREGATOR(self));
  self->priv->statistics.declare(
      {"sets-incomplete", "sets-dropped-incomplete", "sets-dropped-few-cameras", "sets-refused",
       "sets-overdue", "sets-unwanted", "views-late", "views-duplicate", "views-held",
       "views-unusable", "rigs-refused", "frame-step"});
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
          "Counters since the start: sets (meshes sent), sets-incomplete, sets-dropped-…, "
          "sets-overdue (came when nobody could use them), sets-unwanted (left out because not all "
          "can be done), views-…, "
          "empty-meshes, lone-silhouettes (one camera sees a foreground), full-silhouettes "
          "(foreground fills the frame), hulls-reused, predicates and exact-predicates; and of "
          "the last set cameras (with foreground), faces, vertices, triangles and the milliseconds "
          "each phase took. Live: wait-ms and latency-ms as they are now, frame-step (every how "
          "many instants one is asked for), and of each camera lateness-ms-NAME, the most that a "
          "view of the last ten seconds came after its instant, and late-views-NAME, views that "
          "came after their set had gone."));
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
  aggregator_class->src_event = src_event;
  aggregator_class->src_query = src_query;
  aggregator_class->start = start;
  aggregator_class->stop = stop;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(hullbuild, "hullbuild", GST_RANK_NONE, polyhull_hull_build_get_type())
