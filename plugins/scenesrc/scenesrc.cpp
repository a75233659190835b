// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// scenesrc: draws a glTF scene (or a built-in room): area lights with soft shadows, mirrors, one
/// diffuse bounce. The light on the scene is traced once; a moving viewport then costs rasterising
/// what it shows, and a still one nothing. Before each buffer that it first holds for, the sticky
/// event "polyhull-announcement" says which camera, lights and scene made the picture, so that
/// composite draws its subjects with exactly those. Mouse and keys (GstNavigation) move the
/// viewport, or a tracked camera at the pad track does.
#include <gst/base/gstpushsrc.h>
#include <gst/video/video.h>

#include "base/stopwatch.h"
#include "base/thread_pool.h"
#include "plugins/common/camera/camera_track.h"
#include "plugins/common/live/frame_source.h"
#include "plugins/scenesrc/properties.h"
#include "plugins/scenesrc/stream.h"

GST_DEBUG_CATEGORY_STATIC(scenesrc_debug);
#define GST_CAT_DEFAULT scenesrc_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

GstPadProbeReturn announce(GstPad* pad, GstPadProbeInfo*, gpointer source);

struct SceneSrc : FrameSource {
  static constexpr char type_name[] = "PolyhullSceneSrc";
  static constexpr char refusal[] = "A scene cannot be drawn as";
  static GType base_type() { return GST_TYPE_PUSH_SRC; }
  static void class_init(gpointer klass);

  explicit SceneSrc(gpointer object)
      : FrameSource(object), track(GST_ELEMENT_CAST(object), statistics) {
    statistics.declare({"frames", "frames-drawn", "frames-refined", "frames-repeated",
                        "frames-skipped", "frames-unwanted", "light-fills", "light-points",
                        "light-loads", "light-exact", "light-rays", "rays", "pixels-smoothed",
                        "samples", "scene-changes", "scenes-unusable", "lights-missing", "warnings",
                        "clipped"});
    gst_base_src_set_live(GST_BASE_SRC(object), settings.live);
    gst_pad_add_probe(GST_BASE_SRC_PAD(object), GST_PAD_PROBE_TYPE_BUFFER, announce, object,
                      nullptr);
  }
  void property_set(gpointer object, std::string_view name) {
    if (name == "is-live")
      gst_base_src_set_live(GST_BASE_SRC(object), snapshot(object, settings).live);
    if (name == "scene" || name == "environment" || name == "environment-turn") {
      const ObjectLock lock(object);
      ++settings.scene_choice;
    }
  }
  /// Reads the scene.
  void open(GstElement* element) {
    stream.open(snapshot(element, settings));
    {
      const ObjectLock lock(element);
      control = ViewportControl{};
    }
    start(element);
    statistics.reset();
    // A frame is asked for as soon as the pad src is active, which GstElement makes first: the
    // track's must be by then, or that frame finds it flushing and goes without a pose.
    g_autoptr(GstPad) track_pad = gst_element_get_static_pad(element, "track");
    if (track_pad) gst_pad_set_active(track_pad, TRUE);
  }
  void close(GstElement*) { stream.close(); }
  bool take(GstBaseSrc* source, GstEvent* event);

  SceneSettings settings;  // these two: under the object lock
  ViewportControl control;

  Statistics statistics{"scenesrc-stats"};
  CameraTrack track;
  SceneStream stream;  // the streaming thread's; PAUSED is entered and left without one
};

GstCaps* fixate(GstBaseSrc* source, GstCaps* caps) {
  caps = gst_caps_make_writable(caps);
  GstStructure* structure = gst_caps_get_structure(caps, 0);
  gst_structure_fixate_field_nearest_int(structure, "width", 1280);
  gst_structure_fixate_field_nearest_int(structure, "height", 720);
  gst_structure_fixate_field_nearest_fraction(structure, "framerate", 25, 1);
  if (gst_structure_has_field(structure, "pixel-aspect-ratio")) {
    gst_structure_fixate_field_nearest_fraction(structure, "pixel-aspect-ratio", 1, 1);
  }
  return GST_BASE_SRC_CLASS(parent_class<SceneSrc>())->fixate(source, caps);
}

/// The base class sends a pending segment after create() and before the buffer; a sticky event of
/// ours must come after that one, so it is sent when the buffer is on its way.
GstPadProbeReturn announce(GstPad* pad, GstPadProbeInfo*, gpointer data) {
  SceneStream& stream = state_of<SceneSrc>(data).stream;
  if (!stream.is_open()) return GST_PAD_PROBE_OK;
  if (GstEvent* event = stream.take_announcement()) {
    GST_DEBUG_OBJECT(data, "announces %" GST_PTR_FORMAT, printed(event));
    gst_pad_push_event(pad, event);
  }
  return GST_PAD_PROBE_OK;
}

/// The tracked camera at the time \p pts of the stream. A live frame waits for no pose: it shows the
/// last one.
std::optional<TrackedPose> tracked_at(SceneSrc& self, GstBaseSrc* source, GstClockTime pts) {
  const guint64 time = gst_segment_to_running_time(&source->segment, GST_FORMAT_TIME, pts);
  if (!GST_CLOCK_TIME_IS_VALID(time)) return {};
  return self.track.at({static_cast<std::int64_t>(time)}, gst_base_src_is_live(source)
                                                              ? std::optional<std::int64_t>(0)
                                                              : std::nullopt);
}

/// Has the stream show the scene that is asked for, as soon as that can be; true if that is another one.
/// Its animation is at stream time \p pts.
bool follow_scene(SceneSrc& self, GstBaseSrc* source, const SceneSettings& settings,
                  GstClockTime pts) {
  SceneWish wish;
  wish.seconds = static_cast<double>(pts) / GST_SECOND;
  wish.live = gst_base_src_is_live(source);
  wish.stopped = [&] { return self.track.unlocked(); };
  wish.followed = [&](const SceneFile& file) {
    return followers_ready(GST_BASE_SRC_PAD(source), file);
  };
  wish.warn = [&](const std::string& why) {
    self.statistics.warn(GST_ELEMENT(source), "scenes-unusable", why);
  };
  if (!self.stream.follow_scene(settings, wish)) return false;
  self.statistics.count("scene-changes");
  return true;
}

/// What became of a frame.
struct DrawnFrame {
  FrameClock::Frame clock;
  Background::Work work;
  bool lit, refined;
  double spent;  // ms
};

/// Counts the frame and warns of what it has shown; \p not_kept_before: as the light's file was before.
void tell(GstElement* element, SceneSrc& self, const SceneSettings& settings,
          const DrawnFrame& frame, const std::string& not_kept_before) {
  self.statistics.count("frames");
  self.statistics.count("frames-skipped", frame.clock.late);
  self.statistics.count("frames-unwanted", frame.clock.unwanted);
  if (frame.work == Background::Work::none && !frame.lit) {
    self.statistics.count(frame.refined ? "frames-refined" : "frames-repeated");
  } else {
    self.statistics.count("frames-drawn");
    self.statistics.count("rays", self.stream.background().view_statistics().rays);
    self.statistics.count("pixels-smoothed", self.stream.background().view_statistics().smoothed);
    self.statistics.set("last-drawn-ms", frame.spent);
  }
  if (frame.lit) {
    const Background& background = self.stream.background();
    self.statistics.count(background.light_was_kept() ? "light-loads" : "light-fills");
    self.statistics.set_count("light-points", background.light_nodes());
    self.statistics.set("light-ms", self.stream.take_light_ms().value_or(frame.spent));
  }
  const bool exact = self.stream.background().light_is_exact();
  const std::string& why = self.stream.background().light_not_kept();
  if (!why.empty() && (frame.lit || why != not_kept_before))
    self.statistics.warn(element, "warnings", why);
  if (frame.work != Background::Work::none)
    if (const std::string too_bright = self.stream.clipped(settings); !too_bright.empty())
      self.statistics.warn(element, "clipped", too_bright);
  self.statistics.set_count("light-exact", exact);
  self.statistics.set_count("light-rays", self.stream.background().light_rays());
  self.statistics.set_count("samples", self.stream.background().samples());
  self.statistics.set("last-frame-ms", frame.spent);
}

GstFlowReturn create(GstPushSrc* push, GstBuffer** out) {
  auto* source = GST_BASE_SRC(push);
  SceneSrc& self = state_of<SceneSrc>(push);
  SceneStream& stream = self.stream;
  Statistics& statistics = self.statistics;
  return guarded(GST_ELEMENT(push), GST_FLOW_ERROR, [&] {
    const GstVideoInfo info = snapshot(push, self.info);
    if (GST_VIDEO_INFO_FORMAT(&info) == GST_VIDEO_FORMAT_UNKNOWN || !stream.is_open())
      return GST_FLOW_NOT_NEGOTIATED;
    const bool first = !stream.is_lit();
    // The pose, the viewport and what controllers drive are all of the time that the buffer will have.
    FrameClock::Frame next = self.clock.next();
    gst_object_sync_values(GST_OBJECT(push), next.time);
    const bool other = follow_scene(self, source, snapshot(push, self.settings), next.time);
    if (self.track.unlocked()) return GST_FLOW_FLUSHING;
    const Stopwatch watch;
    const LoopWatch loops;
    const std::string said = stream.background().light_not_kept();
    if (other || first)
      if (const std::string why = stream.about_scene(snapshot(push, self.settings)); !why.empty())
        statistics.warn(GST_ELEMENT(push), "warnings", why);
    bool lit = false;
    if (gst_base_src_is_live(source) && first) {
      // The light takes its time; which frame is due is known after that.
      lit = stream.draw(GST_ELEMENT(push), statistics, snapshot(push, self.settings), {}, {}, info,
                        next.time) == Background::Work::lit;
      next = self.clock.next();
      gst_object_sync_values(GST_OBJECT(push), next.time);
      follow_scene(self, source, snapshot(push, self.settings), next.time);
    }
    const GstClockTime pts = next.time;
    const std::optional<TrackedPose> tracked = tracked_at(self, source, pts);
    if (self.track.unlocked()) return GST_FLOW_FLUSHING;
    const auto [settings, control] = snapshots(push, self.settings, self.control);

    const Background::Work work =
        stream.draw(GST_ELEMENT(push), statistics, settings, control, tracked, info, pts);
    lit |= work == Background::Work::lit;
    const bool refined = work == Background::Work::none &&
                         stream.refine(source, settings, info, self.clock.due(next));
    GstBuffer* buffer = stream.make_buffer(info, work != Background::Work::none || refined);
    const DrawnFrame drawn{next, work, lit, refined, watch.milliseconds()};
    tell(GST_ELEMENT(push), self, settings, drawn, said);
    statistics.set("threads-used", loops.threads());
    GST_LOG_OBJECT(push, "%s in %.1f ms, %s",
                   lit                              ? "lit and drawn"
                   : work != Background::Work::none ? "drawn"
                   : refined                        ? "refined"
                                                    : "nothing has changed: the picture before",
                   drawn.spent, tracked ? "from the tracked camera" : "from the viewport");
    self.clock.finish(next, buffer);
    *out = buffer;
    return GST_FLOW_OK;
  });
}

/// Mouse and keys; and a seek, which is the track's, too.
bool SceneSrc::take(GstBaseSrc* source, GstEvent* event) {
  if (GST_EVENT_TYPE(event) == GST_EVENT_SEEK) track.seek(gst_event_ref(event));
  if (GST_EVENT_TYPE(event) != GST_EVENT_NAVIGATION) return false;
  const ObjectLock lock(source);
  navigate(event, control, info.height);
  return true;
}

GstPad* request_new_pad(GstElement* element, GstPadTemplate* pad_template, const gchar*,
                        const GstCaps*) {
  GstPad* pad = state_of<SceneSrc>(element).track.make_pad(pad_template);
  if (pad == nullptr) return nullptr;
  if (GST_STATE(element) > GST_STATE_READY) gst_pad_set_active(pad, TRUE);
  gst_element_add_pad(element, pad);
  return pad;
}

void release_pad(GstElement* element, GstPad* pad) {
  gst_pad_set_active(pad, FALSE);
  state_of<SceneSrc>(element).track.forget_pad();
  gst_element_remove_pad(element, pad);
}

gboolean unlock(GstBaseSrc* source) {
  state_of<SceneSrc>(source).track.unlock(true);
  return TRUE;
}

/// Also where a seek's flush ends: no frame is being made.
gboolean unlock_stop(GstBaseSrc* source) {
  CameraTrack& track = state_of<SceneSrc>(source).track;
  track.video_flushed();
  track.unlock(false);
  return TRUE;
}

void SceneSrc::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(scenesrc_debug, "scenesrc", 0, "lit synthetic scene");
  add_properties<SceneSrc>(klass, viewport_properties(), &SceneSrc::settings);
  add_properties<SceneSrc>(klass, scene_properties(), &SceneSrc::settings);
  add_statistics<SceneSrc>(
      klass,
      "Counters since the start: frames, frames-drawn (new views), frames-refined, "
      "frames-repeated (nothing had changed: no work), frames-skipped (left out when live and "
      "late), frames-unwanted (left out because what follows cannot keep up), rays and "
      "pixels-smoothed (of drawn frames: that show several triangles, or with rays are drawn with "
      "eight), samples (per pixel, in the picture now), light-fills (how often the light was "
      "computed), light-loads (found in a file), light-exact (1: it is not on its way there), "
      "light-rays (of the light in the picture), light-points, scene-changes, scenes-unusable "
      "(that could not be loaded while playing: the last one stayed), lights-missing (changes of "
      "the property lights to lights that the scene does not have), warnings, clipped (1: most of "
      "a "
      "picture was "
      "white, as a warning said once); of the pad track poses, "
      "poses-unusable, frames-tracked, frames-untracked (before the first pose, or more than a "
      "second after the last), frames-ahead (tracked, but later than the last pose), track-losses; "
      "times in milliseconds: last-frame-ms, last-drawn-ms, light-ms; and threads-used (how many "
      "threads took part in the last frame's parallel loops, on average).");
  set_metadata(klass, "Scene source", "Source/Video",
               "Lit picture of a glTF scene, with its camera and lights announced for compositing");
  add_template(klass, "src", GST_PAD_SRC,
               "video/x-raw, format=(string){ RGBA, BGRA, RGBx, BGRx }, width=(int)[1, 16384], "
               "height=(int)[1, 16384], framerate=(fraction)[1/2147483647, 2147483647/1], "
               "colorimetry=(string)sRGB, pixel-aspect-ratio=(fraction)1/1");
  add_template(klass, "track", GST_PAD_SINK, camera_caps, G_TYPE_NONE, GST_PAD_REQUEST);
  install_frame_source<SceneSrc>(klass);
  GST_ELEMENT_CLASS(klass)->request_new_pad = request_new_pad;
  GST_ELEMENT_CLASS(klass)->release_pad = release_pad;
  GST_BASE_SRC_CLASS(klass)->unlock = unlock;
  GST_BASE_SRC_CLASS(klass)->unlock_stop = unlock_stop;
  GST_BASE_SRC_CLASS(klass)->fixate = fixate;
  GST_PUSH_SRC_CLASS(klass)->create = create;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(scenesrc, "scenesrc", GST_RANK_NONE, type_of<SceneSrc>())
