// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// composite: puts filmed subjects into the picture of a synthetic scene. The background's picture
/// is the scene as it is without them; the scene's geometry hides them where it stands in front;
/// they throw a soft shadow of each light and are mirrored in the planar mirror in which they are largest. Draws
/// with OpenGL or, without a graphics processor, on the processor; pictures come and go in system
/// memory or as memory:GLMemory.
#include <gst/base/gstaggregator.h>
#include <gst/gl/gl.h>
#include <gst/video/video.h>

#include <cstring>

#include "base/error.h"
#include "plugins/common/guard.h"
#include "plugins/common/log.h"
#include "plugins/common/memory/video_frame.h"
#include "plugins/common/memory/video_pool.h"
#include "plugins/composite/caps.h"
#include "plugins/composite/element.h"

GST_DEBUG_CATEGORY(composite_debug);

namespace polyhull::element {
namespace {

/// The aggregator's own way of making pads calls all of them sink_%u.
GstAggregatorPad* create_new_pad(GstAggregator* aggregator, GstPadTemplate* pad_template,
                                 const gchar* name, const GstCaps*) {
  const bool mesh = g_strcmp0(GST_PAD_TEMPLATE_NAME_TEMPLATE(pad_template), "background") != 0;
  const auto taken = [&](const gchar* other) {
    for (GList* l = GST_ELEMENT_CAST(aggregator)->pads; l != nullptr; l = l->next)
      if (g_strcmp0(GST_OBJECT_NAME(l->data), other) == 0) return true;
    return false;
  };
  std::string chosen;
  {
    const ObjectLock lock(aggregator);
    if (!mesh) {
      chosen = "background";
    } else if (name != nullptr && g_str_has_prefix(name, "mesh_") && strchr(name, '%') == nullptr) {
      chosen = name;
    } else {
      for (guint number = 0; chosen.empty() || taken(chosen.c_str()); ++number)
        chosen = fmt::format("mesh_{}", number);
    }
    if (taken(chosen.c_str())) return nullptr;
  }
  return static_cast<GstAggregatorPad*>(
      g_object_new(mesh ? type_of<MeshPadState>() : type_of<LivePadState>(), "name", chosen.c_str(),
                   "direction", GST_PAD_SINK, "template", pad_template, nullptr));
}

// ---- negotiation

GstFlowReturn update_src_caps(GstAggregator* aggregator, GstCaps* wanted, GstCaps** result) {
  Composite& self = state_of<Composite>(aggregator);
  const bool linked = guarded(GST_ELEMENT_CAST(aggregator), false, [&] {
    check_background(CompositePads(aggregator));
    return true;
  });
  if (!linked) return GST_FLOW_ERROR;
  if (GST_VIDEO_INFO_FORMAT(&self.background_info) != GST_VIDEO_FORMAT_RGBA)
    return GST_AGGREGATOR_FLOW_NEED_DATA;
  self.send_held_first = self.held.buffer != nullptr;
  if (self.send_held_first) return GST_AGGREGATOR_FLOW_NEED_DATA;
  GstCaps* own = output_caps(self.background_info, self.background_on_gpu);
  *result = gst_caps_intersect_full(own, wanted, GST_CAPS_INTERSECT_FIRST);
  gst_caps_unref(own);
  return gst_caps_is_empty(*result) ? GST_FLOW_NOT_NEGOTIATED : GST_FLOW_OK;
}

gboolean negotiated_src_caps(GstAggregator* aggregator, GstCaps* caps) {
  Composite& self = state_of<Composite>(aggregator);
  if (!gst_video_info_from_caps(&self.output_info, caps)) return FALSE;
  self.output_on_gpu = is_gl_caps(caps);
  GST_DEBUG_OBJECT(aggregator, "the output is %" GST_PTR_FORMAT, printed(caps));
  return GST_AGGREGATOR_CLASS(parent_class<Composite>())->negotiated_src_caps(aggregator, caps);
}

gboolean decide_allocation(GstAggregator* aggregator, GstQuery* query) {
  Composite& self = state_of<Composite>(aggregator);
  return guarded(GST_ELEMENT_CAST(aggregator), gboolean{FALSE}, [&]() -> gboolean {
    if (self.output_on_gpu) self.gl.ensure();
    GST_DEBUG_OBJECT(aggregator, "frames are allocated in %s",
                     self.output_on_gpu ? "OpenGL's memory" : "system memory");
    return decide_video_pool(query, self.output_on_gpu ? self.gl.context() : nullptr);
  });
}

gboolean propose_allocation(GstAggregator*, GstAggregatorPad* pad, GstQuery*, GstQuery* query) {
  if (is_mesh_pad(pad)) return FALSE;
  gst_query_add_allocation_meta(query, GST_VIDEO_META_API_TYPE, nullptr);
  return TRUE;
}

gboolean sink_query(GstAggregator* aggregator, GstAggregatorPad* pad, GstQuery* query) {
  if (GST_QUERY_TYPE(query) == GST_QUERY_CONTEXT &&
      state_of<Composite>(aggregator).gl.answer(query))
    return TRUE;
  if (!is_mesh_pad(pad) && is_scene_query(query)) {
    const SceneFile file = scene_of(query);
    const bool ready = state_of<Composite>(aggregator).composer.is_ready_for(file);
    answer_scene(query, followers_ready(aggregator->srcpad, file) && ready);
    return TRUE;
  }
  if (!is_mesh_pad(pad) && GST_QUERY_TYPE(query) == GST_QUERY_CAPS) {
    answer_background_caps(aggregator->srcpad, query);
    return TRUE;
  }
  return GST_AGGREGATOR_CLASS(parent_class<Composite>())->sink_query(aggregator, pad, query);
}

// ---- events

void take_announcement(Composite& self, GstEvent* event) {
  const gchar* json = gst_structure_get_string(gst_event_get_structure(event), "json");
  try {
    if (!json) throw Error(Error::Kind::bad_input, "The event has no field 'json'.");
    self.composer.announce(parse_announcement(json));
    self.announced = true;
    self.statistics.count("announcements");
    GST_DEBUG_OBJECT(self.element, "the background announces %s", json);
  } catch (const Error& error) {
    self.statistics.warn(
        GST_ELEMENT_CAST(self.element), "announcements-unusable",
        fmt::format(
            "What the background announced of its camera and scene was not understood and is "
            "not used: {}",
            error.what()));
  }
}

gboolean take_caps(Composite& self, GstEvent* event) {
  GstCaps* caps = nullptr;
  gst_event_parse_caps(event, &caps);
  if (!self.picture.set_format(caps)) return FALSE;
  self.background_info = self.picture.info();
  GstVideoInfo info;
  if (gst_video_info_from_caps(&info, caps))
    warn_of_wide_colours(GST_ELEMENT_CAST(self.element), self.statistics, info);
  self.background_on_gpu = is_gl_caps(caps);
  GST_DEBUG_OBJECT(self.element, "the background is %" GST_PTR_FORMAT, printed(caps));
  self.height = GST_VIDEO_INFO_HEIGHT(&self.background_info);
  gst_pad_mark_reconfigure(self.element->srcpad);
  return TRUE;
}

guint composited_signal = 0;

void set_context(GstElement* element, GstContext* context) {
  state_of<Composite>(element).gl.set_context(context);
  GST_ELEMENT_CLASS(parent_class<Composite>())->set_context(element, context);
}

}  // namespace

void Composite::property_set(gpointer object, std::string_view name) {
  if (name != "scene") return;
  const ObjectLock lock(object);
  ++settings.scene_choice;
}

bool Composite::answer(GstQuery* query) {
  return GST_QUERY_TYPE(query) == GST_QUERY_CONTEXT && gl.answer(query);
}

GstStructure* Composite::statistics_of(gpointer) {
  GstStructure* stats = statistics.structure();
  timing.tell(stats);
  return stats;
}

void Composite::tell_composited(std::optional<std::uint64_t> shown) {
  if (shown) g_signal_emit(element, composited_signal, 0, guint64{*shown});
}

bool Composite::hear(GstAggregatorPad* pad, GstEvent* event) {
  if (is_mesh_pad(pad)) return true;
  if (GST_EVENT_TYPE(event) == GST_EVENT_CAPS && !take_caps(*this, event)) return false;
  if (GST_EVENT_TYPE(event) == GST_EVENT_SEGMENT) new_segment = true;
  if (gst_event_has_name(event, "polyhull-announcement"))
    guarded(GST_ELEMENT_CAST(element), 0, [&] {
      take_announcement(*this, event);
      return 0;
    });
  return true;
}

gboolean Composite::navigate(GstEvent* event) {
  if (announced) {
    const CompositePads pads(element);
    if (pads.background) return gst_pad_push_event(GST_PAD(pads.background), event);
  } else {
    bool moved = false;
    {
      const ObjectLock lock(element);
      moved = settings.navigate && settings.key_frames.empty() &&
              element::navigate(event, control, height);
      if (moved) settings.set_pose(control.take(settings.pose()));
    }
    if (moved)
      for (const auto& row : viewport_properties()) g_object_notify(G_OBJECT(element), row.name);
  }
  gst_event_unref(event);
  return TRUE;
}

// ---- the class

Composite::Composite(gpointer object)
    : LiveAggregator(object, "composite-stats"), gl(GST_ELEMENT_CAST(object)) {
  forget_formats();
  statistics.declare({"frames", "frames-overdue", "frames-unwanted", "frames-lost", "frame-step",
                      "passed-through", "no-mesh", "meshes", "meshes-unusable", "announcements",
                      "announcements-unusable"});
}

constexpr char statistics_blurb[] =
    "Counters since the start: frames, frames-overdue (left out because they came too late to be "
    "used), frames-unwanted (left out because not all can be drawn), frames-lost (with "
    "async-readback, as OpenGL failed), frame-step (every how many frames of the background one "
    "is drawn), passed-through (the background went out untouched), backgrounds-converted (to "
    "RGBA, and to the output's NV12 or I420; one that stays the same is kept), "
    "colours-unconverted (backgrounds of high dynamic range or of BT.2020's primaries), drawn, "
    "drawn-by-processor, "
    "rays (traced by it), gl-failures (OpenGL failed, and the processor went on), no-mesh, "
    "meshes, meshes-unusable, meshes-without-surface (nothing of them to draw with "
    "subject=mesh), subjects-unmatched (match found no light), "
    "through-lens (frames that the lens changed; lens-ms: the time for it), motion-blurred "
    "(frames in which the viewport moved), lens-without-scene (frames blurred by a depth that "
    "nobody knows), "
    "scenes-unusable (that could not be loaded while playing: the last one stayed), "
    "viewports-unusable (frames with an impossible viewport or broken key frames: the last one "
    "stayed), image-based (subjects drawn so), image-based-refused (that could not), "
    "announcements, "
    "announcements-unusable, …-skipped and …-reused "
    "(work left out), scene-planes-taken (new views whose triangles the background's source had "
    "brought to the screen), pictures-uploaded and -skipped, bytes-uploaded (to OpenGL), of "
    "these background-bytes-uploaded (none where the background stays the same), pixels-shaded "
    "(whose "
    "layers were put together; not known of OpenGL ES) and pixels-changed (those that came out "
    "other than the background; neither of pictures in OpenGL's memory); and of the last frame "
    "frame-ms and the milliseconds per pass on the CPU (…-ms) and, of a frame shortly before, on "
    "the graphics processor (…-gpu-ms, negative where it cannot tell). Live: wait-ms and "
    "latency-ms as they are now.";

void Composite::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(composite_debug, "composite", 0, "subjects into scenes");
  prefer_egl_device_without_display();
  add_properties<Composite>(klass, composite_properties(), &Composite::settings);
  add_properties<Composite>(klass, viewport_properties(), &Composite::settings);
  add_force_live<Composite>(
      klass,
      "Whether frames go out by their deadline even if no source is live, so that a silent mesh "
      "input cannot stall the picture. Can only be set when the element is made.");
  add_statistics<Composite>(klass, statistics_blurb);
  composited_signal = g_signal_new("composited", G_TYPE_FROM_CLASS(klass), G_SIGNAL_RUN_LAST, 0,
                                   nullptr, nullptr, nullptr, G_TYPE_NONE, 1, G_TYPE_UINT64);
  set_metadata(klass, "Scene compositor", "Filter/Effect/Video/Compositor",
               "Puts textured visual hulls into the picture of a synthetic scene, with occlusion, "
               "shadow and mirror image");
  add_template(klass, "mesh_%u", GST_PAD_SINK, mesh_caps, type_of<MeshPadState>(), GST_PAD_REQUEST);
  static const std::string any_video = fmt::format("{}; {}", picture_caps, converted_caps);
  add_template(klass, "background", GST_PAD_SINK, any_video.c_str(), type_of<LivePadState>(),
               GST_PAD_REQUEST);
  add_template(klass, "src", GST_PAD_SRC, composite_output_caps, GST_TYPE_AGGREGATOR_PAD);
  gst_type_mark_as_plugin_api(type_of<MeshPadState>(), static_cast<GstPluginAPIFlags>(0));
  install_live_aggregator<Composite>(klass);
  GST_ELEMENT_CLASS(klass)->set_context = set_context;
  GstAggregatorClass* aggregator_class = GST_AGGREGATOR_CLASS(klass);
  aggregator_class->create_new_pad = create_new_pad;
  aggregator_class->aggregate = composite_aggregate;
  aggregator_class->get_next_time = composite_next_time;
  aggregator_class->update_src_caps = update_src_caps;
  aggregator_class->negotiated_src_caps = negotiated_src_caps;
  aggregator_class->decide_allocation = decide_allocation;
  aggregator_class->propose_allocation = propose_allocation;
  aggregator_class->sink_query = sink_query;
  aggregator_class->flush = composite_flush;
  aggregator_class->start = composite_start;
  aggregator_class->stop = composite_stop;
}

}  // namespace polyhull::element

using namespace polyhull::element;
GST_ELEMENT_REGISTER_DEFINE(composite, "composite", GST_RANK_NONE, type_of<Composite>())
