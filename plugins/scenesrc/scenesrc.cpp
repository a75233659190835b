// SPDX-License-Identifier: LGPL-2.1-or-later
/**
 * SECTION:element-scenesrc
 * @title: scenesrc
 * @short_description: A ray-traced synthetic scene, seen by a viewport that may move
 *
 * scenesrc draws a glTF scene (or a built-in room) by ray tracing: area lights with soft shadows,
 * mirrors, one diffuse bounce. The light on the scene is computed once; a moving viewport then
 * costs rays only, and a still one nothing. Before each buffer that it first holds for, the sticky
 * event "polyhull-announcement" says which camera, lights and scene made the picture, so that
 * composite draws its subjects with exactly those. Mouse and keys (GstNavigation) move the
 * viewport.
 *
 * `scene`, `path=orbit`, `eye-*`, `target-*` and `fov` say what is seen; `light-*` and
 * `exposure-compensation` can be changed while it plays.
 *
 * ## Example launch line
 * |[
 * gst-launch-1.0 scenesrc path=orbit num-buffers=50 ! video/x-raw,width=640,height=360
 * ! videoconvert ! autovideosink
 * ]|
 */
#include "plugins/scenesrc/scenesrc.h"

#include <gst/base/gstpushsrc.h>
#include <gst/video/navigation.h>
#include <gst/video/video.h>

#include <chrono>
#include <mutex>

#include "plugins/common/guard.h"
#include "plugins/common/live/frame_clock.h"
#include "plugins/common/statistics.h"
#include "plugins/scenesrc/properties.h"
#include "plugins/scenesrc/stream.h"

GST_DEBUG_CATEGORY_STATIC(scenesrc_debug);
#define GST_CAT_DEFAULT scenesrc_debug

using namespace polyhull;
using namespace polyhull::element;

namespace {

struct State {
  explicit State(GstBaseSrc* source) : clock(source) {}
  // Under the object lock:
  SceneSettings settings;
  ViewportControl control;
  GstVideoInfo info;

  Statistics statistics{"scenesrc-stats"};
  FrameClock clock;
  SceneStream stream;  // the streaming thread's; PAUSED is entered and left without one
};

}  // namespace

struct PolyhullSceneSrc {
  GstPushSrc parent;
  State* state;
};
struct PolyhullSceneSrcClass {
  GstPushSrcClass parent_class;
};

G_DEFINE_TYPE(PolyhullSceneSrc, polyhull_scene_src, GST_TYPE_PUSH_SRC)
#define SCENE_SRC(object) (reinterpret_cast<PolyhullSceneSrc*>(object))

GST_ELEMENT_REGISTER_DEFINE(scenesrc, "scenesrc", GST_RANK_NONE, polyhull_scene_src_get_type())

namespace {

constexpr guint first_property = 1;
guint stats_property = 0;

void set_property_of(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  State& state = *SCENE_SRC(object)->state;
  if (!set_property<SceneSettings>(object, scene_properties(), first_property, state.settings, id,
                                   value)) {
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  } else if (g_str_equal(spec->name, "is-live")) {
    gst_base_src_set_live(GST_BASE_SRC(object), g_value_get_boolean(value));
  } else if (g_str_equal(spec->name, old_exposure_name)) {
    static std::once_flag said;  // a controller sets it with every frame
    std::call_once(said, [] {
      g_warning(
          "The property exposure of scenesrc is deprecated: it is called exposure-compensation "
          "now, with the same values (stops).");
    });
  }
}

void get_property_of(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  State& state = *SCENE_SRC(object)->state;
  if (id == stats_property) {
    g_value_take_boxed(value, state.statistics.structure());
  } else if (!get_property<SceneSettings>(object, scene_properties(), first_property,
                                          state.settings, id, value)) {
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  }
}

/// Reads the scene. Not in GstBaseSrc::start, after whose failure the base class would post a
/// second error that says nothing.
bool open(PolyhullSceneSrc* self) {
  State& state = *self->state;
  const SceneSettings settings = snapshot(self, state.settings);
  return guarded(GST_ELEMENT(self), false, [&] {
    state.stream.open(settings);
    GST_OBJECT_LOCK(self);
    gst_video_info_init(&state.info);
    state.control = ViewportControl{};
    GST_OBJECT_UNLOCK(self);
    state.clock.reset();
    state.statistics.reset();
    return true;
  });
}

GstStateChangeReturn change_state(GstElement* element, GstStateChange transition) {
  PolyhullSceneSrc* self = SCENE_SRC(element);
  if (transition == GST_STATE_CHANGE_READY_TO_PAUSED && !open(self))
    return GST_STATE_CHANGE_FAILURE;
  const GstStateChangeReturn result =
      GST_ELEMENT_CLASS(polyhull_scene_src_parent_class)->change_state(element, transition);
  if (transition == GST_STATE_CHANGE_PAUSED_TO_READY ||
      (transition == GST_STATE_CHANGE_READY_TO_PAUSED && result == GST_STATE_CHANGE_FAILURE)) {
    self->state->stream.close();
  }
  return result;
}

GstCaps* fixate(GstBaseSrc* source, GstCaps* caps) {
  caps = gst_caps_make_writable(caps);
  GstStructure* structure = gst_caps_get_structure(caps, 0);
  gst_structure_fixate_field_nearest_int(structure, "width", 1280);
  gst_structure_fixate_field_nearest_int(structure, "height", 720);
  gst_structure_fixate_field_nearest_fraction(structure, "framerate", 25, 1);
  if (gst_structure_has_field(structure, "pixel-aspect-ratio")) {
    gst_structure_fixate_field_nearest_fraction(structure, "pixel-aspect-ratio", 1, 1);
  }
  return GST_BASE_SRC_CLASS(polyhull_scene_src_parent_class)->fixate(source, caps);
}

gboolean set_caps(GstBaseSrc* source, GstCaps* caps) {
  State& state = *SCENE_SRC(source)->state;
  GstVideoInfo info;
  if (!gst_video_info_from_caps(&info, caps) || GST_VIDEO_INFO_FPS_N(&info) <= 0) {
    GST_ELEMENT_ERROR(source, STREAM, FORMAT,
                      ("A scene cannot be drawn as %" GST_PTR_FORMAT
                       ": raw video with a frame rate above 0 is expected.",
                       static_cast<void*>(caps)),
                      (nullptr));
    return FALSE;
  }
  GST_OBJECT_LOCK(source);
  state.info = info;
  GST_OBJECT_UNLOCK(source);
  state.clock.set_rate(GST_VIDEO_INFO_FPS_N(&info), GST_VIDEO_INFO_FPS_D(&info));
  gst_base_src_set_blocksize(source, static_cast<guint>(info.size));
  return TRUE;
}

/// The base class sends a pending segment after create() and before the buffer; a sticky event of
/// ours must come after that one, so it is sent when the buffer is on its way.
GstPadProbeReturn announce(GstPad* pad, GstPadProbeInfo*, gpointer data) {
  State& state = *SCENE_SRC(data)->state;
  if (!state.stream.is_open()) return GST_PAD_PROBE_OK;
  if (GstEvent* event = state.stream.take_announcement()) gst_pad_push_event(pad, event);
  return GST_PAD_PROBE_OK;
}

GstFlowReturn create(GstPushSrc* push, GstBuffer** out) {
  auto* source = GST_BASE_SRC(push);
  State& state = *SCENE_SRC(push)->state;
  SceneStream& stream = state.stream;
  Statistics& statistics = state.statistics;
  return guarded(GST_ELEMENT(push), GST_FLOW_ERROR, [&] {
    const GstVideoInfo info = snapshot(push, state.info);
    if (GST_VIDEO_INFO_FORMAT(&info) == GST_VIDEO_FORMAT_UNKNOWN || !stream.is_open())
      return GST_FLOW_NOT_NEGOTIATED;
    const auto begin = std::chrono::steady_clock::now();
    bool lit = false;
    if (gst_base_src_is_live(source) && !stream.is_lit()) {
      // The light takes its time; which frame is due is known after that.
      lit = stream.draw(GST_ELEMENT(push), statistics, snapshot(push, state.settings), {}, info,
                        state.clock.next().time) == Background::Work::lit;
    }
    const FrameClock::Frame next = state.clock.next();
    const GstClockTime pts = next.time;
    gst_object_sync_values(GST_OBJECT(push), pts);
    GST_OBJECT_LOCK(push);
    const SceneSettings settings = state.settings;
    const ViewportControl control = state.control;
    GST_OBJECT_UNLOCK(push);

    const Background::Work work =
        stream.draw(GST_ELEMENT(push), statistics, settings, control, info, pts);
    lit |= work == Background::Work::lit;
    const bool refined = work == Background::Work::none && stream.refine(source, settings, state.clock.due(next));
    GstBuffer* buffer = stream.make_buffer(info, work != Background::Work::none || refined);
    const std::chrono::duration<double, std::milli> spent =
        std::chrono::steady_clock::now() - begin;

    statistics.count("frames");
    statistics.count("frames-skipped", next.late);
    statistics.count("frames-unwanted", next.unwanted);
    if (work == Background::Work::none && !lit) {
      statistics.count(refined ? "frames-refined" : "frames-repeated");
    } else {
      statistics.count("frames-drawn");
      statistics.count("rays", stream.background().view_statistics().rays);
      statistics.count("pixels-smoothed", stream.background().view_statistics().smoothed);
      statistics.set("last-drawn-ms", spent.count());
    }
    if (lit) {
      statistics.count("light-fills");
      statistics.count("light-rays", stream.background().light_rays());
      statistics.set_count("light-points", stream.background().light_nodes());
      statistics.set("light-ms", spent.count());
    }
    statistics.set_count("samples", stream.background().samples());
    statistics.set("last-frame-ms", spent.count());

    state.clock.finish(next, buffer);
    *out = buffer;
    return GST_FLOW_OK;
  });
}

/// Mouse, keys and the pace from downstream.
gboolean handle_event(GstBaseSrc* source, GstEvent* event) {
  if (SCENE_SRC(source)->state->clock.hear(event)) return TRUE;
  if (GST_EVENT_TYPE(event) != GST_EVENT_NAVIGATION) {
    return GST_BASE_SRC_CLASS(polyhull_scene_src_parent_class)->event(source, event);
  }
  State& state = *SCENE_SRC(source)->state;
  gdouble x = 0, y = 0, dx = 0, dy = 0;
  gint button = 0;
  const gchar* key = nullptr;
  GST_OBJECT_LOCK(source);
  switch (gst_navigation_event_get_type(event)) {
    case GST_NAVIGATION_EVENT_MOUSE_BUTTON_PRESS:
      if (gst_navigation_event_parse_mouse_button_event(event, &button, &x, &y)) {
        state.control.press(button, x, y);
      }
      break;
    case GST_NAVIGATION_EVENT_MOUSE_BUTTON_RELEASE:
      if (gst_navigation_event_parse_mouse_button_event(event, &button, &x, &y)) {
        state.control.release(button);
      }
      break;
    case GST_NAVIGATION_EVENT_MOUSE_MOVE:
      if (gst_navigation_event_parse_mouse_move_event(event, &x, &y)) {
        state.control.move(x, y, state.info.height);
      }
      break;
    case GST_NAVIGATION_EVENT_MOUSE_SCROLL:
      if (gst_navigation_event_parse_mouse_scroll_event(event, &x, &y, &dx, &dy)) {
        state.control.wheel(dy > 0 ? 1.0 : dy < 0 ? -1.0 : 0.0);
      }
      break;
    case GST_NAVIGATION_EVENT_KEY_PRESS:
      if (gst_navigation_event_parse_key_event(event, &key) && key != nullptr)
        state.control.key(key);
      break;
    default:
      break;
  }
  GST_OBJECT_UNLOCK(source);
  return TRUE;
}

gboolean is_seekable(GstBaseSrc*) {
  return TRUE;
}

FrameClock& clock_of(GstBaseSrc* source) {
  return SCENE_SRC(source)->state->clock;
}

gboolean query(GstBaseSrc* source, GstQuery* query) {
  if (GST_QUERY_TYPE(query) == GST_QUERY_LATENCY) return clock_of(source).answer_latency(query);
  if (GST_QUERY_TYPE(query) != GST_QUERY_CONVERT) {
    return GST_BASE_SRC_CLASS(polyhull_scene_src_parent_class)->query(source, query);
  }
  GstFormat from, to;
  gint64 value = 0, result = 0;
  gst_query_parse_convert(query, &from, &value, &to, nullptr);
  const GstVideoInfo info = snapshot(source, SCENE_SRC(source)->state->info);
  if (info.finfo == nullptr || GST_VIDEO_INFO_FORMAT(&info) == GST_VIDEO_FORMAT_UNKNOWN ||
      !gst_video_info_convert(&info, from, value, to, &result)) {
    return FALSE;
  }
  gst_query_set_convert(query, from, value, to, result);
  return TRUE;
}

void finalize(GObject* object) {
  delete SCENE_SRC(object)->state;
  G_OBJECT_CLASS(polyhull_scene_src_parent_class)->finalize(object);
}

}  // namespace

static void polyhull_scene_src_init(PolyhullSceneSrc* self) {
  self->state = new State(GST_BASE_SRC(self));
  gst_video_info_init(&self->state->info);
  self->state->statistics.declare({"frames", "frames-drawn", "frames-refined", "frames-repeated",
                                   "frames-skipped", "frames-unwanted", "light-fills", "light-points", "light-rays",
                                   "rays", "pixels-smoothed", "samples", "warnings"});
  gst_base_src_set_format(GST_BASE_SRC(self), GST_FORMAT_TIME);
  gst_base_src_set_live(GST_BASE_SRC(self), self->state->settings.live);
  gst_pad_add_probe(GST_BASE_SRC_PAD(self), GST_PAD_PROBE_TYPE_BUFFER, announce, self, nullptr);
}

static void polyhull_scene_src_class_init(PolyhullSceneSrcClass* klass) {
  auto* object = G_OBJECT_CLASS(klass);
  auto* element = GST_ELEMENT_CLASS(klass);
  auto* source = GST_BASE_SRC_CLASS(klass);
  GST_DEBUG_CATEGORY_INIT(scenesrc_debug, "scenesrc", 0, "ray-traced synthetic scene");
  object->set_property = set_property_of;
  object->get_property = get_property_of;
  object->finalize = finalize;
  stats_property = install_properties<SceneSettings>(object, scene_properties(), first_property);
  g_object_class_install_property(
      object, stats_property,
      statistics_property(
          "Counters since the start: frames, frames-drawn (new views), frames-refined, "
          "frames-repeated (nothing had changed: no work), frames-skipped (left out when live and "
          "late), frames-unwanted (left out because what follows cannot keep up), rays and pixels-smoothed (of drawn frames), samples (per pixel, in the picture "
          "now), light-fills (how often the light was computed), light-rays, light-points, "
          "warnings; "
          "and times in milliseconds: last-frame-ms, last-drawn-ms, light-ms."));
  gst_element_class_set_static_metadata(
      element, "Scene source", "Source/Video",
      "Ray-traced picture of a glTF scene, with its camera and lights announced for compositing",
      "polyhull");
  GstCaps* caps = gst_caps_from_string(
      "video/x-raw, format=(string){ RGBA, BGRA, RGBx, BGRx }, width=(int)[1, 16384], "
      "height=(int)[1, 16384], framerate=(fraction)[1/2147483647, 2147483647/1], "
      "colorimetry=(string)sRGB, pixel-aspect-ratio=(fraction)1/1");
  gst_element_class_add_pad_template(
      element, gst_pad_template_new("src", GST_PAD_SRC, GST_PAD_ALWAYS, caps));
  gst_caps_unref(caps);
  element->change_state = change_state;
  source->set_caps = set_caps;
  source->fixate = fixate;
  source->event = handle_event;
  source->get_times = [](GstBaseSrc* self, GstBuffer* buffer, GstClockTime* begin,
                         GstClockTime* end) { clock_of(self).get_times(buffer, begin, end); };
  source->is_seekable = is_seekable;
  source->do_seek = [](GstBaseSrc* self, GstSegment* segment) -> gboolean {
    return clock_of(self).seek(segment);
  };
  source->query = query;
  GST_PUSH_SRC_CLASS(klass)->create = create;
  gst_type_mark_as_plugin_api(polyhull_scene_src_get_type(), static_cast<GstPluginAPIFlags>(0));
}
