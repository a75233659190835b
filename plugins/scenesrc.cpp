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
 * `scene`, `path=orbit`, `eye-*`, `target-*` and `fov` say what is seen; `light-*` and `exposure`
 * can be changed while it plays.
 *
 * ## Example launch line
 * |[
 * gst-launch-1.0 scenesrc path=orbit num-buffers=50 ! video/x-raw,width=640,height=360
 * ! videoconvert ! autovideosink
 * ]|
 */
#include "scenesrc.h"

#include <gst/base/gstpushsrc.h>
#include <gst/video/navigation.h>
#include <gst/video/video.h>

#include <chrono>
#include <cmath>
#include <memory>

#include "base/error.h"
#include "common/guard.h"
#include "common/statistics.h"
#include "raytrace/background.h"
#include "scenesrc_properties.h"

GST_DEBUG_CATEGORY_STATIC(scenesrc_debug);
#define GST_CAT_DEFAULT scenesrc_debug

using namespace polyhull;
using namespace polyhull::element;

namespace {

constexpr int refined_rows = 8;  // between two looks at the clock

/// What lives from READY to PAUSED and back.
struct Stream {
  std::unique_ptr<Background> background;
  std::vector<Light> lights;    // as in the scene's file
  float exposure = 1.0f;        // as in the scene's file
  GstMemory* pixels = nullptr;  // of the last frame, shared with the buffers that show it
  GstVideoFormat pixels_format = GST_VIDEO_FORMAT_UNKNOWN;
  Camera camera;                     // the last good one; width 0: none yet
  std::string announced;             // what downstream was last told
  GstEvent* announcement = nullptr;  // to be sent before the next buffer
  // Live: how late the first frame was. The base class delays all that follow by as much.
  GstClockTime delay = GST_CLOCK_TIME_NONE;
};

struct State {
  // Under the object lock:
  SceneSettings settings;
  ViewportControl control;
  GstVideoInfo info;
  std::uint64_t next_frame = 0;  // since first_time
  GstClockTime first_time = 0;   // of the frames counted with this frame rate

  Statistics statistics{"scenesrc-stats"};
  Stream stream;  // the streaming thread's; PAUSED is entered and left without one
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

void forget_pixels(Stream& stream) {
  if (stream.pixels != nullptr) gst_memory_unref(stream.pixels);
  stream.pixels = nullptr;
}

void close(PolyhullSceneSrc* self) {
  Stream& stream = self->state->stream;
  forget_pixels(stream);
  gst_clear_event(&stream.announcement);
  stream = Stream{};
}

/// Reads the scene. Not in GstBaseSrc::start, after whose failure the base class would post a
/// second error that says nothing.
bool open(PolyhullSceneSrc* self) {
  State& state = *self->state;
  const SceneSettings settings = snapshot(self, state.settings);
  return guarded(GST_ELEMENT(self), false, [&] {
    Scene scene = open_scene(settings.scene);
    state.stream.lights = scene.lights;
    state.stream.exposure = scene.exposure;
    BackgroundOptions options;
    options.light.spacing = static_cast<float>(settings.light_spacing);
    options.light.bounce_spacing = 5.6f * options.light.spacing;
    options.paths.light_samples = 2;
    state.stream.background = std::make_unique<Background>(std::move(scene), options);
    GST_OBJECT_LOCK(self);
    gst_video_info_init(&state.info);
    state.next_frame = 0;
    state.first_time = 0;
    state.control = ViewportControl{};
    GST_OBJECT_UNLOCK(self);
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
    close(self);
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

GstClockTime time_of(const State& state, std::uint64_t number) {
  return state.first_time +
         gst_util_uint64_scale(number, GST_SECOND * state.info.fps_d, state.info.fps_n);
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
  if (GST_VIDEO_INFO_FORMAT(&state.info) != GST_VIDEO_FORMAT_UNKNOWN) {
    // A new frame rate goes on at the same time.
    state.first_time = time_of(state, state.next_frame);
    state.next_frame = 0;
  }
  state.info = info;
  GST_OBJECT_UNLOCK(source);
  gst_base_src_set_blocksize(source, static_cast<guint>(info.size));
  return TRUE;
}

/// Running time now, or none where there is no clock or the element does not play.
GstClockTime running_time(GstBaseSrc* source) {
  GstClock* clock = gst_element_get_clock(GST_ELEMENT(source));
  if (clock == nullptr) return GST_CLOCK_TIME_NONE;
  const GstClockTime now = gst_clock_get_time(clock);
  const GstClockTime base = gst_element_get_base_time(GST_ELEMENT(source));
  gst_object_unref(clock);
  return GST_STATE(source) == GST_STATE_PLAYING && now >= base ? now - base : GST_CLOCK_TIME_NONE;
}

/// Frames that a live source is too late for.
std::uint64_t late_frames(GstBaseSrc* source, const GstVideoInfo& info, GstClockTime pts,
                          GstClockTime delay) {
  GstClockTime now = running_time(source);
  if (!gst_base_src_is_live(source) || now == GST_CLOCK_TIME_NONE) return 0;
  if (delay != GST_CLOCK_TIME_NONE) now -= std::min(now, delay);
  const guint64 position =
      gst_segment_position_from_running_time(&source->segment, GST_FORMAT_TIME, now);
  if (position == GST_CLOCK_TIME_NONE || position <= pts) return 0;
  return gst_util_uint64_scale(position - pts, info.fps_n, GST_SECOND * info.fps_d);
}

/// Makes the background's picture that of now; what it did.
Background::Work draw(PolyhullSceneSrc* self, const SceneSettings& settings,
                      const ViewportControl& control, const GstVideoInfo& info, GstClockTime pts) {
  State& state = *self->state;
  Stream& stream = state.stream;
  Background& background = *stream.background;
  try {
    stream.camera = scene_viewport(settings, control, background.scene(),
                                   static_cast<double>(pts) / GST_SECOND, info.width, info.height);
  } catch (const Error& error) {
    // A viewport that is impossible for a moment does not end the stream.
    if (stream.camera.width != info.width || stream.camera.height != info.height) throw;
    state.statistics.warn(GST_ELEMENT(self), "warnings",
                          std::string(error.what()) + " The last viewport stays.");
  }
  return background.update(stream.camera, scene_lights(settings, stream.lights),
                           stream.exposure * static_cast<float>(std::exp2(settings.exposure)));
}

/// Traces a still view further; true when the picture has become better.
bool refine(PolyhullSceneSrc* self, const SceneSettings& settings, GstClockTime pts) {
  Background& background = *self->state->stream.background;
  if (background.samples() >= settings.samples || settings.refinement == Refinement::never)
    return false;
  if (settings.refinement == Refinement::always) return background.refine(background.height());
  auto* source = GST_BASE_SRC(self);
  if (!gst_base_src_is_live(source)) return false;
  guint64 due = gst_segment_to_running_time(&source->segment, GST_FORMAT_TIME, pts);
  const GstClockTime delay = self->state->stream.delay;
  if (due == GST_CLOCK_TIME_NONE || delay == GST_CLOCK_TIME_NONE) return false;
  due += delay;
  bool better = false;
  while (!better) {
    const GstClockTime now = running_time(source);
    if (now == GST_CLOCK_TIME_NONE || now + GST_MSECOND >= due) break;
    better = background.refine(refined_rows);
  }
  return better;
}

/// A buffer with the background's picture; a picture that has not changed is the same memory again.
GstBuffer* make_buffer(Stream& stream, const GstVideoInfo& info, bool changed) {
  const GstVideoFormat format = GST_VIDEO_INFO_FORMAT(&info);
  GstBuffer* buffer = nullptr;
  if (changed || stream.pixels == nullptr || stream.pixels_format != format ||
      gst_memory_get_sizes(stream.pixels, nullptr, nullptr) != info.size) {
    buffer = gst_buffer_new_allocate(nullptr, info.size, nullptr);
    GstMapInfo map;
    if (buffer == nullptr || !gst_buffer_map(buffer, &map, GST_MAP_WRITE)) {
      gst_clear_buffer(&buffer);
      throw Error(Error::Kind::io, "There is no memory for a picture of " +
                                       std::to_string(info.width) + "x" +
                                       std::to_string(info.height) + ".");
    }
    const bool bgr = format == GST_VIDEO_FORMAT_BGRx || format == GST_VIDEO_FORMAT_BGRA;
    stream.background->write(
        map.data, static_cast<std::size_t>(GST_VIDEO_INFO_PLANE_STRIDE(&info, 0)), bgr ? 2 : 0);
    gst_buffer_unmap(buffer, &map);
    forget_pixels(stream);
    stream.pixels = gst_buffer_get_memory(buffer, 0);
    stream.pixels_format = format;
  } else {
    buffer = gst_buffer_new();
    gst_buffer_append_memory(buffer, gst_memory_ref(stream.pixels));
  }
  return buffer;
}

void prepare_announcement(Stream& stream) {
  std::string json = announcement_to_json(stream.background->announcement());
  if (json == stream.announced) return;
  stream.announced = std::move(json);
  gst_clear_event(&stream.announcement);
  stream.announcement =
      gst_event_new_custom(GST_EVENT_CUSTOM_DOWNSTREAM_STICKY,
                           gst_structure_new("polyhull-announcement", "json", G_TYPE_STRING,
                                             stream.announced.c_str(), nullptr));
}

/// The base class sends a pending segment after create() and before the buffer; a sticky event of
/// ours must come after that one, so it is sent when the buffer is on its way.
GstPadProbeReturn announce(GstPad* pad, GstPadProbeInfo*, gpointer data) {
  Stream& stream = SCENE_SRC(data)->state->stream;
  if (GstEvent* event = std::exchange(stream.announcement, nullptr)) gst_pad_push_event(pad, event);
  return GST_PAD_PROBE_OK;
}

GstFlowReturn create(GstPushSrc* push, GstBuffer** out) {
  auto* source = GST_BASE_SRC(push);
  PolyhullSceneSrc* self = SCENE_SRC(push);
  State& state = *self->state;
  Stream& stream = state.stream;
  return guarded(GST_ELEMENT(push), GST_FLOW_ERROR, [&] {
    GST_OBJECT_LOCK(push);
    const GstVideoInfo info = state.info;
    std::uint64_t number = state.next_frame;
    if (GST_VIDEO_INFO_FORMAT(&info) == GST_VIDEO_FORMAT_UNKNOWN || !stream.background) {
      GST_OBJECT_UNLOCK(push);
      return GST_FLOW_NOT_NEGOTIATED;
    }
    const GstClockTime planned = time_of(state, number);
    GST_OBJECT_UNLOCK(push);
    const auto begin = std::chrono::steady_clock::now();
    const bool first_live = gst_base_src_is_live(source) && stream.delay == GST_CLOCK_TIME_NONE;
    bool lit = false;
    if (first_live) {
      // The light takes its time; which frame is due is known after that.
      lit = draw(self, snapshot(push, state.settings), {}, info, planned) == Background::Work::lit;
    }
    const std::uint64_t skipped = late_frames(source, info, planned, stream.delay);
    number += skipped;
    GST_OBJECT_LOCK(push);
    const GstClockTime pts = time_of(state, number), next = time_of(state, number + 1);
    GST_OBJECT_UNLOCK(push);
    gst_object_sync_values(GST_OBJECT(push), pts);
    GST_OBJECT_LOCK(push);
    const SceneSettings settings = state.settings;
    const ViewportControl control = state.control;
    GST_OBJECT_UNLOCK(push);

    const Background::Work work = draw(self, settings, control, info, pts);
    lit |= work == Background::Work::lit;
    const bool refined = work == Background::Work::none && refine(self, settings, pts);
    GstBuffer* buffer = make_buffer(stream, info, work != Background::Work::none || refined);
    prepare_announcement(stream);
    const std::chrono::duration<double, std::milli> spent =
        std::chrono::steady_clock::now() - begin;

    Statistics& statistics = state.statistics;
    statistics.count("frames");
    statistics.count("frames-skipped", skipped);
    if (work == Background::Work::none && !lit) {
      statistics.count(refined ? "frames-refined" : "frames-repeated");
    } else {
      statistics.count("frames-drawn");
      statistics.count("rays", stream.background->view_statistics().rays);
      statistics.count("pixels-smoothed", stream.background->view_statistics().smoothed);
      statistics.set("last-drawn-ms", spent.count());
    }
    if (lit) {
      statistics.count("light-fills");
      statistics.count("light-rays", stream.background->light_rays());
      statistics.set_count("light-points", stream.background->light_nodes());
      statistics.set("light-ms", spent.count());
    }
    statistics.set_count("samples", stream.background->samples());
    statistics.set("last-frame-ms", spent.count());

    GST_BUFFER_PTS(buffer) = pts;
    GST_BUFFER_DTS(buffer) = GST_CLOCK_TIME_NONE;
    GST_BUFFER_DURATION(buffer) = next - pts;
    GST_BUFFER_OFFSET(buffer) = number;
    GST_BUFFER_OFFSET_END(buffer) = number + 1;
    GST_OBJECT_LOCK(push);
    state.next_frame = number + 1;
    GST_OBJECT_UNLOCK(push);
    if (first_live) {
      const GstClockTime now = running_time(source);
      const guint64 due = gst_segment_to_running_time(&source->segment, GST_FORMAT_TIME, pts);
      stream.delay = now != GST_CLOCK_TIME_NONE && due < now ? now - due : 0;
    }
    *out = buffer;
    return GST_FLOW_OK;
  });
}

/// Mouse and keys from downstream.
gboolean handle_event(GstBaseSrc* source, GstEvent* event) {
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

void get_times(GstBaseSrc* source, GstBuffer* buffer, GstClockTime* begin, GstClockTime* end) {
  *begin = *end = GST_CLOCK_TIME_NONE;
  if (!gst_base_src_is_live(source)) return;
  *begin = GST_BUFFER_PTS(buffer);
  *end = GST_BUFFER_PTS(buffer) + GST_BUFFER_DURATION(buffer);
}

gboolean is_seekable(GstBaseSrc* source) {
  return !gst_base_src_is_live(source);
}

gboolean do_seek(GstBaseSrc* source, GstSegment* segment) {
  if (segment->rate < 0.0) {
    GST_WARNING_OBJECT(source, "Playing backwards is not supported.");
    return FALSE;
  }
  State& state = *SCENE_SRC(source)->state;
  segment->time = segment->start;
  GST_OBJECT_LOCK(source);
  // Counted from time 0 again; before the frame rate is known that is all there is to say.
  state.first_time = 0;
  state.next_frame = 0;
  if (GST_VIDEO_INFO_FORMAT(&state.info) != GST_VIDEO_FORMAT_UNKNOWN) {
    state.next_frame =
        gst_util_uint64_scale(segment->position, state.info.fps_n, GST_SECOND * state.info.fps_d);
    if (time_of(state, state.next_frame + 1) <= segment->position) ++state.next_frame;
  } else {
    state.first_time = segment->position;
  }
  GST_OBJECT_UNLOCK(source);
  return TRUE;
}

gboolean query(GstBaseSrc* source, GstQuery* query) {
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
  close(SCENE_SRC(object));
  delete SCENE_SRC(object)->state;
  G_OBJECT_CLASS(polyhull_scene_src_parent_class)->finalize(object);
}

}  // namespace

static void polyhull_scene_src_init(PolyhullSceneSrc* self) {
  self->state = new State;
  gst_video_info_init(&self->state->info);
  self->state->statistics.declare({"frames", "frames-drawn", "frames-refined", "frames-repeated",
                                   "frames-skipped", "light-fills", "light-points", "light-rays",
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
          "late), rays and pixels-smoothed (of drawn frames), samples (per pixel, in the picture "
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
  source->get_times = get_times;
  source->is_seekable = is_seekable;
  source->do_seek = do_seek;
  source->query = query;
  GST_PUSH_SRC_CLASS(klass)->create = create;
  gst_type_mark_as_plugin_api(polyhull_scene_src_get_type(), static_cast<GstPluginAPIFlags>(0));
}
