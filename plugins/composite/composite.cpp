// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// composite: puts filmed subjects into the picture of a synthetic scene. The background's picture
/// is the scene as it is without them; the scene's geometry hides them where it stands in front;
/// they throw a soft shadow of the main light and are mirrored in the largest planar mirror. Draws
/// with OpenGL; pictures come and go in system memory or as memory:GLMemory.
///
/// Properties that matter: on each mesh pad `translate-x` … `scale`, the subject's place; `shadow`,
/// `mirror`, `edge-samples`, quality for time. Camera, lights and scene come with the background
/// where it announces them (scenesrc does), else from `scene`, `eye-x` … `field-of-view`, or by
/// mouse and keys.
///
/// gst-launch-1.0 composite name=mix ! videoconvert ! fakesink
///     scenesrc num-buffers=30 ! video/x-raw,width=640,height=360 ! mix.background
///     hullbuild name=hull ! hulltexture ! mix.mesh_0
///     rigtestsrc camera=cam0 num-buffers=30 ! chromamatte ! gaussblur ! contourfind camera=cam0 !
///     hull. rigtestsrc camera=cam1 num-buffers=30 ! chromamatte ! gaussblur ! contourfind
///     camera=cam1 ! hull. rigtestsrc camera=cam2 num-buffers=30 ! chromamatte ! gaussblur !
///     contourfind camera=cam2 ! hull.
#include "plugins/composite/composite.h"

#include <gst/base/gstaggregator.h>
#include <gst/gl/gl.h>
#include <gst/video/navigation.h>
#include <gst/video/video.h>

#include <cstring>

#include "base/error.h"
#include "plugins/common/guard.h"
#include "plugins/common/memory/video_pool.h"
#include "plugins/common/pads_as_children.h"
#include "plugins/composite/caps.h"
#include "plugins/composite/element.h"

GST_DEBUG_CATEGORY_STATIC(composite_debug);
#define GST_CAT_DEFAULT composite_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

enum { first_setting = 1 };
guint force_live_id;
guint stats_id;
GParamSpec* camera_specs[camera_rows];

GType polyhull_composite_get_type();
G_DEFINE_TYPE_WITH_CODE(PolyhullComposite, polyhull_composite, GST_TYPE_AGGREGATOR,
                        G_IMPLEMENT_INTERFACE(GST_TYPE_CHILD_PROXY, pads_as_children))

// ---- properties

void set_property_value(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  if (id == force_live_id) {
    gst_aggregator_set_force_live(GST_AGGREGATOR(object), g_value_get_boolean(value));
  } else if (!set_property(object, composite_properties(), first_setting,
                           private_of(object).settings, id, value)) {
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  }
}

void get_property_value(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  CompositePrivate& priv = private_of(object);
  if (id == stats_id) {
    g_value_take_boxed(value, priv.statistics.structure());
  } else if (id == force_live_id) {
    g_value_set_boolean(value, gst_aggregator_get_force_live(GST_AGGREGATOR(object)));
  } else if (!get_property(object, composite_properties(), first_setting, priv.settings, id,
                           value)) {
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  }
}

// ---- pads

/// The aggregator's own way of making pads calls all of them sink_%u.
GstAggregatorPad* create_new_pad(GstAggregator* aggregator, GstPadTemplate* pad_template,
                                 const gchar* name, const GstCaps*) {
  const bool mesh = g_strcmp0(GST_PAD_TEMPLATE_NAME_TEMPLATE(pad_template), "background") != 0;
  gchar* chosen = nullptr;
  if (!mesh) {
    chosen = g_strdup("background");
  } else if (name != nullptr && g_str_has_prefix(name, "mesh_") && strchr(name, '%') == nullptr) {
    chosen = g_strdup(name);
  }
  GST_OBJECT_LOCK(aggregator);
  const auto taken = [&](const gchar* other) {
    for (GList* l = GST_ELEMENT_CAST(aggregator)->pads; l != nullptr; l = l->next)
      if (g_strcmp0(GST_OBJECT_NAME(l->data), other) == 0) return true;
    return false;
  };
  if (chosen == nullptr) {
    guint number = 0;
    do {
      g_free(chosen);
      chosen = g_strdup_printf("mesh_%u", number++);
    } while (taken(chosen));
  }
  const bool free = !taken(chosen);
  GST_OBJECT_UNLOCK(aggregator);
  gpointer pad = nullptr;
  if (free) {
    pad = g_object_new(mesh ? mesh_pad_type() : live_pad_type(), "name", chosen,
                       "direction", GST_PAD_SINK, "template", pad_template, nullptr);
  }
  g_free(chosen);
  return static_cast<GstAggregatorPad*>(pad);
}

GstPad* request_new_pad(GstElement* element, GstPadTemplate* pad_template, const gchar* name,
                        const GstCaps* caps) {
  GstPad* pad = GST_ELEMENT_CLASS(polyhull_composite_parent_class)
                    ->request_new_pad(element, pad_template, name, caps);
  if (pad != nullptr)
    gst_child_proxy_child_added(GST_CHILD_PROXY(element), G_OBJECT(pad), GST_OBJECT_NAME(pad));
  return pad;
}

void release_pad(GstElement* element, GstPad* pad) {
  gst_child_proxy_child_removed(GST_CHILD_PROXY(element), G_OBJECT(pad), GST_OBJECT_NAME(pad));
  GST_ELEMENT_CLASS(polyhull_composite_parent_class)->release_pad(element, pad);
}

// ---- negotiation

GstFlowReturn update_src_caps(GstAggregator* aggregator, GstCaps* wanted, GstCaps** result) {
  CompositePrivate& priv = private_of(aggregator);
  const bool linked = guarded(GST_ELEMENT_CAST(aggregator), false, [&] {
    check_background(CompositePads(aggregator));
    return true;
  });
  if (!linked) return GST_FLOW_ERROR;
  if (GST_VIDEO_INFO_FORMAT(&priv.background_info) != GST_VIDEO_FORMAT_RGBA)
    return GST_AGGREGATOR_FLOW_NEED_DATA;
  GstCaps* own = output_caps(priv.background_info, priv.background_on_gpu);
  *result = gst_caps_intersect_full(own, wanted, GST_CAPS_INTERSECT_FIRST);
  gst_caps_unref(own);
  return gst_caps_is_empty(*result) ? GST_FLOW_NOT_NEGOTIATED : GST_FLOW_OK;
}

gboolean negotiated_src_caps(GstAggregator* aggregator, GstCaps* caps) {
  CompositePrivate& priv = private_of(aggregator);
  if (!gst_video_info_from_caps(&priv.output_info, caps)) return FALSE;
  priv.output_on_gpu = is_gl_caps(caps);
  return GST_AGGREGATOR_CLASS(polyhull_composite_parent_class)
      ->negotiated_src_caps(aggregator, caps);
}

gboolean decide_allocation(GstAggregator* aggregator, GstQuery* query) {
  CompositePrivate& priv = private_of(aggregator);
  return guarded(GST_ELEMENT_CAST(aggregator), gboolean{FALSE}, [&]() -> gboolean {
    if (priv.output_on_gpu) priv.gl.ensure();
    return decide_video_pool(query, priv.output_on_gpu ? priv.gl.context() : nullptr);
  });
}

gboolean propose_allocation(GstAggregator*, GstAggregatorPad* pad, GstQuery*, GstQuery* query) {
  if (is_mesh_pad(pad)) return FALSE;
  gst_query_add_allocation_meta(query, GST_VIDEO_META_API_TYPE, nullptr);
  return TRUE;
}

gboolean sink_query(GstAggregator* aggregator, GstAggregatorPad* pad, GstQuery* query) {
  if (GST_QUERY_TYPE(query) == GST_QUERY_CONTEXT && private_of(aggregator).gl.answer(query))
    return TRUE;
  if (!is_mesh_pad(pad) && GST_QUERY_TYPE(query) == GST_QUERY_CAPS) {
    answer_background_caps(GST_PAD(pad), aggregator->srcpad, query);
    return TRUE;
  }
  return GST_AGGREGATOR_CLASS(polyhull_composite_parent_class)->sink_query(aggregator, pad, query);
}

gboolean src_query(GstAggregator* aggregator, GstQuery* query) {
  if (GST_QUERY_TYPE(query) == GST_QUERY_CONTEXT && private_of(aggregator).gl.answer(query))
    return TRUE;
  if (GST_QUERY_TYPE(query) == GST_QUERY_LATENCY)
    return private_of(aggregator).timing.answer(query);
  return GST_AGGREGATOR_CLASS(polyhull_composite_parent_class)->src_query(aggregator, query);
}

// ---- events

void take_announcement(PolyhullComposite* self, GstEvent* event) {
  CompositePrivate& priv = *self->priv;
  const gchar* json = gst_structure_get_string(gst_event_get_structure(event), "json");
  try {
    if (!json) throw Error(Error::Kind::bad_input, "it has no field json");
    priv.composer.announce(parse_announcement(json));
    priv.announced = true;
    priv.statistics.count("announcements");
  } catch (const Error& error) {
    priv.statistics.warn(
        GST_ELEMENT_CAST(self), "announcements-unusable",
        std::string("What the background announced of its camera and scene was not "
                    "understood and is not used: ") +
            error.what());
  }
}

gboolean take_caps(PolyhullComposite* self, GstEvent* event) {
  CompositePrivate& priv = *self->priv;
  GstCaps* caps = nullptr;
  gst_event_parse_caps(event, &caps);
  if (!gst_video_info_from_caps(&priv.background_info, caps)) return FALSE;
  priv.background_on_gpu = is_gl_caps(caps);
  gst_pad_mark_reconfigure(GST_AGGREGATOR(self)->srcpad);
  return TRUE;
}

gboolean sink_event(GstAggregator* aggregator, GstAggregatorPad* pad, GstEvent* event) {
  PolyhullComposite* self = self_of(aggregator);
  // Whoever begins here has not heard of the pace.
  if (GST_EVENT_TYPE(event) == GST_EVENT_SEGMENT) live_state_of(pad).told = 0;
  if (!is_mesh_pad(pad)) {
    if (GST_EVENT_TYPE(event) == GST_EVENT_CAPS && !take_caps(self, event)) {
      gst_event_unref(event);
      return FALSE;
    }
    if (GST_EVENT_TYPE(event) == GST_EVENT_SEGMENT) self->priv->new_segment = true;
    if (gst_event_has_name(event, "polyhull-announcement")) {
      guarded(GST_ELEMENT_CAST(self), 0, [&] {
        take_announcement(self, event);
        return 0;
      });
    }
  }
  return GST_AGGREGATOR_CLASS(polyhull_composite_parent_class)->sink_event(aggregator, pad, event);
}

gboolean src_event(GstAggregator* aggregator, GstEvent* event) {
  PolyhullComposite* self = self_of(aggregator);
  self->priv->pace.hear(event);
  if (gst_event_has_name(event, pace_event_name)) {
    gst_event_unref(event);
    return TRUE;
  }
  if (GST_EVENT_TYPE(event) != GST_EVENT_NAVIGATION)
    return GST_AGGREGATOR_CLASS(polyhull_composite_parent_class)->src_event(aggregator, event);
  if (self->priv->announced) {
    const CompositePads pads(self);
    if (pads.background) return gst_pad_push_event(GST_PAD(pads.background), event);
  } else {
    GST_OBJECT_LOCK(self);
    const bool moved =
        self->priv->settings.navigate && self->priv->control.apply(event, self->priv->settings);
    GST_OBJECT_UNLOCK(self);
    for (guint i = 0; moved && i < camera_rows; ++i)
      g_object_notify_by_pspec(G_OBJECT(self), camera_specs[i]);
  }
  gst_event_unref(event);
  return TRUE;
}

// ---- the class

void polyhull_composite_init(PolyhullComposite* self) {
  self->priv = new CompositePrivate(GST_ELEMENT_CAST(self));
  self->priv->statistics.declare({"frames", "frames-overdue", "frames-unwanted", "frame-step",
                                  "passed-through", "drawn", "no-mesh", "meshes",
                                  "meshes-unusable", "announcements", "announcements-unusable",
                                  "subject-skipped", "shadow-skipped", "mirror-skipped",
                                  "scene-depth-reused", "static-shadow-reused", "mesh-reused",
                                  "pictures-uploaded", "pictures-skipped", "bytes-uploaded"});
}

void finalize(GObject* object) {
  delete self_of(object)->priv;
  G_OBJECT_CLASS(polyhull_composite_parent_class)->finalize(object);
}

void set_context(GstElement* element, GstContext* context) {
  private_of(element).gl.set_context(context);
  GST_ELEMENT_CLASS(polyhull_composite_parent_class)->set_context(element, context);
}

void install_all_properties(GObjectClass* klass) {
  force_live_id = install_properties(klass, composite_properties(), first_setting);
  for (guint i = 0; i < camera_rows; ++i)
    camera_specs[i] =
        g_object_class_find_property(klass, composite_properties()[first_camera_row + i].name);
  g_object_class_install_property(
      klass, force_live_id,
      g_param_spec_boolean(
          "force-live", "Force live mode",
          "Whether frames go out by their deadline even if no source is live, so that a silent "
          "mesh "
          "input cannot stall the picture. Can only be set when the element is made.",
          FALSE,
          static_cast<GParamFlags>(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS |
                                   G_PARAM_CONSTRUCT_ONLY)));
  stats_id = force_live_id + 1;
  g_object_class_install_property(
      klass, stats_id,
      statistics_property(
          "Counters since the start: frames, frames-overdue (left out because they came too late to "
          "be used), frames-unwanted (left out because not all can be drawn), frame-step (every "
          "how many frames of the background one is drawn), passed-through (the background went "
          "out untouched), drawn, "
          "no-mesh, meshes, meshes-unusable, announcements, announcements-unusable, …-skipped and "
          "…-reused (work left out), pictures-uploaded and -skipped, bytes-uploaded; and of the "
          "last "
          "frame frame-ms and the milliseconds per pass on the CPU (…-ms) and, of a frame shortly "
          "before, on the graphics processor (…-gpu-ms, negative where it cannot tell)."));
}

void polyhull_composite_class_init(PolyhullCompositeClass* klass) {
  GST_DEBUG_CATEGORY_INIT(composite_debug, "composite", 0, "subjects into scenes");
  GObjectClass* object_class = G_OBJECT_CLASS(klass);
  object_class->set_property = set_property_value;
  object_class->get_property = get_property_value;
  object_class->finalize = finalize;
  install_all_properties(object_class);
  prefer_egl_device_without_display();

  GstElementClass* element_class = GST_ELEMENT_CLASS(klass);
  gst_element_class_set_static_metadata(element_class, "Scene compositor",
                                        "Filter/Effect/Video/Compositor",
                                        "Puts textured visual hulls into the picture of a "
                                        "synthetic scene, with occlusion, shadow and "
                                        "mirror image",
                                        "polyhull");
  element_class->request_new_pad = request_new_pad;
  element_class->release_pad = release_pad;
  element_class->set_context = set_context;
  GstCaps* meshes = gst_caps_from_string(mesh_caps);
  GstCaps* video = gst_caps_from_string(composite_video_caps);
  gst_element_class_add_pad_template(
      element_class, gst_pad_template_new_with_gtype("mesh_%u", GST_PAD_SINK, GST_PAD_REQUEST,
                                                     meshes, mesh_pad_type()));
  gst_element_class_add_pad_template(
      element_class, gst_pad_template_new_with_gtype("background", GST_PAD_SINK, GST_PAD_REQUEST,
                                                     video, live_pad_type()));
  gst_element_class_add_pad_template(
      element_class, gst_pad_template_new_with_gtype("src", GST_PAD_SRC, GST_PAD_ALWAYS, video,
                                                     GST_TYPE_AGGREGATOR_PAD));
  gst_caps_unref(meshes);
  gst_caps_unref(video);
  gst_type_mark_as_plugin_api(mesh_pad_type(), static_cast<GstPluginAPIFlags>(0));

  GstAggregatorClass* aggregator_class = GST_AGGREGATOR_CLASS(klass);
  aggregator_class->create_new_pad = create_new_pad;
  aggregator_class->aggregate = composite_aggregate;
  aggregator_class->get_next_time = composite_next_time;
  aggregator_class->update_src_caps = update_src_caps;
  aggregator_class->negotiated_src_caps = negotiated_src_caps;
  aggregator_class->decide_allocation = decide_allocation;
  aggregator_class->propose_allocation = propose_allocation;
  aggregator_class->sink_query = sink_query;
  aggregator_class->src_query = src_query;
  aggregator_class->sink_event = sink_event;
  aggregator_class->src_event = src_event;
  aggregator_class->flush = composite_flush;
  aggregator_class->start = composite_start;
  aggregator_class->stop = composite_stop;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(composite, "composite", GST_RANK_NONE, polyhull_composite_get_type())
