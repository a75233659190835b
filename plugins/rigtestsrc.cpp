// SPDX-License-Identifier: LGPL-2.1-or-later
/**
 * SECTION:element-rigtestsrc
 * @title: rigtestsrc
 * @short_description: One camera of a rig, filming a synthetic person before a green or blue screen
 *
 * What videotestsrc is to video, rigtestsrc is to a studio of calibrated cameras. Each element is
 * one camera of a rig; all of them show the same instant of the same subject for the same
 * timestamp, and number their frames alike (GST_BUFFER_OFFSET), as cameras behind one trigger do.
 * The subject is a walking, waving figure, or any closed surface from an OBJ file. `unevenness`,
 * `shadow`, `spill` and `noise` spoil the picture as a real studio does; chroma subsampling comes
 * with the negotiated format. The truth is there to compare with: `output=matte`, `output=depth`
 * and `mesh-location`.
 *
 * ## Example launch line
 * |[
 * gst-launch-1.0 rigtestsrc camera=cam0 num-buffers=50 ! video/x-raw,framerate=25/1 ! videoconvert
 * ! autovideosink
 * ]|
 */
#include "rigtestsrc.h"

#include <gst/base/gstpushsrc.h>
#include <gst/video/gstvideopool.h>
#include <gst/video/video.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <memory>
#include <vector>

#include "base/error.h"
#include "common/guard.h"
#include "common/numbered_name.h"
#include "common/statistics.h"
#include "rigtestsrc_draw.h"
#include "rigtestsrc_settings.h"

GST_DEBUG_CATEGORY_STATIC(rigtestsrc_debug);
#define GST_CAT_DEFAULT rigtestsrc_debug

namespace polyhull::element {

namespace {

using Settings = RigTestSettings;

constexpr const char* picture_formats = "{ RGBx, BGRx, RGBA, BGRA, I420, NV12, YUY2, UYVY }";

/// What lives from start() to stop().
struct Stream {
  RigTestDrawing drawing;
  RigOutput output = RigOutput::picture;  // of the properties when the stream began
  std::shared_ptr<const Subject> subject;
  Rig rig;
  std::unique_ptr<NumberedName> mesh_name;
  GstVideoInfo info;
  std::uint64_t next_frame = 0;
  GstClockTime wanted_time = 0;  // sought before the frame rate was known
};

struct State {
  Settings settings;  // under the object lock
  Statistics statistics{"rigtestsrc-stats"};
  Stream stream;  // the streaming thread's; start() and stop() run without it. Under the object
                  // lock: info, next_frame
};

}  // namespace
}  // namespace polyhull::element

using namespace polyhull;
using namespace polyhull::element;

struct PolyhullRigTestSrc {
  GstPushSrc parent;
  State* state;
};
struct PolyhullRigTestSrcClass {
  GstPushSrcClass parent_class;
};

G_DEFINE_TYPE(PolyhullRigTestSrc, polyhull_rig_test_src, GST_TYPE_PUSH_SRC)
#define RIG_TEST_SRC(object) (reinterpret_cast<PolyhullRigTestSrc*>(object))

GST_ELEMENT_REGISTER_DEFINE(rigtestsrc, "rigtestsrc", GST_RANK_NONE,
                            polyhull_rig_test_src_get_type())

namespace {

constexpr guint first_property = 1;
guint stats_property = 0;

void set_property_of(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  State& state = *RIG_TEST_SRC(object)->state;
  if (!set_property<Settings>(object, rig_test_properties(), first_property, state.settings, id,
                              value)) {
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
    return;
  }
  if (g_str_equal(spec->name, "is-live")) {
    gst_base_src_set_live(GST_BASE_SRC(object), g_value_get_boolean(value));
  }
}

void get_property_of(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  State& state = *RIG_TEST_SRC(object)->state;
  if (id == stats_property) {
    g_value_take_boxed(value, state.statistics.structure());
  } else if (!get_property<Settings>(object, rig_test_properties(), first_property, state.settings,
                                     id, value)) {
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  }
}

int find_camera(const Rig& rig, const Settings& settings) {
  if (settings.camera.empty()) return 0;
  std::string names;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    if (rig.cameras[i].name == settings.camera) return static_cast<int>(i);
    names += (i ? ", " : "") + rig.cameras[i].name;
  }
  throw Error(Error::Kind::not_found,
              "The rig " + (settings.rig.empty() ? "built in" : "'" + settings.rig + "'") +
                  " has no camera called '" + settings.camera + "'. Its cameras are: " + names +
                  ".");
}

/// Opens rig and subject. Not in GstBaseSrc::start, after whose failure the base class would post a
/// second error that says nothing.
gboolean open(GstBaseSrc* source) {
  State& state = *RIG_TEST_SRC(source)->state;
  const Settings settings = snapshot(source, state.settings);
  return guarded(GST_ELEMENT(source), FALSE, [&] {
    Stream stream;
    stream.rig = settings.rig.empty() ? default_rig() : load_rig(settings.rig);
    const int camera = find_camera(stream.rig, settings);
    stream.subject = open_subject(settings.subject, settings.subject_height);
    stream.output = settings.output;
    stream.drawing.metres_per_unit = stream.rig.metres_per_unit();
    if (!settings.mesh_location.empty()) {
      stream.mesh_name = std::make_unique<NumberedName>(settings.mesh_location);
    }
    stream.drawing.picture = std::make_unique<CameraPicture>(stream.rig, camera, stream.subject);
    gst_video_info_init(&stream.info);
    state.statistics.reset();
    if (!stream.subject->warning().empty()) {
      state.statistics.warn(GST_ELEMENT(source), "warnings", stream.subject->warning());
    }
    GST_OBJECT_LOCK(source);
    state.stream = std::move(stream);
    GST_OBJECT_UNLOCK(source);
    return TRUE;
  });
}

void close(GstBaseSrc* source) {
  State& state = *RIG_TEST_SRC(source)->state;
  GST_OBJECT_LOCK(source);
  Stream old = std::move(state.stream);
  state.stream = Stream{};
  GST_OBJECT_UNLOCK(source);
}

GstStateChangeReturn change_state(GstElement* element, GstStateChange transition) {
  auto* source = GST_BASE_SRC(element);
  if (transition == GST_STATE_CHANGE_READY_TO_PAUSED && !open(source))
    return GST_STATE_CHANGE_FAILURE;
  const GstStateChangeReturn result =
      GST_ELEMENT_CLASS(polyhull_rig_test_src_parent_class)->change_state(element, transition);
  if (transition == GST_STATE_CHANGE_PAUSED_TO_READY ||
      (transition == GST_STATE_CHANGE_READY_TO_PAUSED && result == GST_STATE_CHANGE_FAILURE)) {
    close(source);
  }
  return result;
}

GstCaps* get_caps(GstBaseSrc* source, GstCaps* filter) {
  State& state = *RIG_TEST_SRC(source)->state;
  GstCaps* caps = gst_pad_get_pad_template_caps(GST_BASE_SRC_PAD(source));
  caps = gst_caps_make_writable(caps);
  GST_OBJECT_LOCK(source);
  RigOutput output = state.settings.output;
  if (state.stream.drawing.picture) {
    const Camera& camera = state.stream.drawing.picture->camera();
    output = state.stream.output;
    gst_caps_set_simple(caps, "width", G_TYPE_INT, camera.width, "height", G_TYPE_INT,
                        camera.height, nullptr);
  }
  GST_OBJECT_UNLOCK(source);
  GValue formats = G_VALUE_INIT;
  const char* allowed = output == RigOutput::picture ? picture_formats
                        : output == RigOutput::keyed ? "{ RGBA, BGRA }"
                        : output == RigOutput::matte ? "GRAY8"
                                                     : "GRAY16_LE";
  if (*allowed == '{') {
    g_value_init(&formats, GST_TYPE_LIST);
  } else {
    g_value_init(&formats, G_TYPE_STRING);
  }
  gst_value_deserialize(&formats, allowed);
  gst_caps_set_value(caps, "format", &formats);
  g_value_unset(&formats);
  if (filter != nullptr) {
    GstCaps* both = gst_caps_intersect_full(filter, caps, GST_CAPS_INTERSECT_FIRST);
    gst_caps_unref(caps);
    caps = both;
  }
  return caps;
}

GstCaps* fixate(GstBaseSrc* source, GstCaps* caps) {
  caps = gst_caps_make_writable(caps);
  GstStructure* structure = gst_caps_get_structure(caps, 0);
  gst_structure_fixate_field_nearest_fraction(structure, "framerate", 25, 1);
  caps = GST_BASE_SRC_CLASS(polyhull_rig_test_src_parent_class)->fixate(source, caps);
  // Say outright what the format leaves to convention: the colours' coding and where the chroma
  // lies.
  GstVideoInfo info;
  if (!gst_video_info_from_caps(&info, caps)) return caps;
  GstCaps* full = gst_video_info_to_caps(&info);
  caps = gst_caps_make_writable(caps);
  structure = gst_caps_get_structure(caps, 0);
  for (const char* field : {"pixel-aspect-ratio", "interlace-mode", "colorimetry", "chroma-site"}) {
    const GValue* value = gst_structure_get_value(gst_caps_get_structure(full, 0), field);
    if (value != nullptr && !gst_structure_has_field(structure, field)) {
      gst_structure_set_value(structure, field, value);
    }
  }
  gst_caps_unref(full);
  if (GST_VIDEO_INFO_IS_YUV(&info) && !gst_structure_has_field(structure, "chroma-site")) {
    gst_structure_set(structure, "chroma-site", G_TYPE_STRING, "mpeg2", nullptr);
  }
  return caps;
}

GstClockTime time_of(const GstVideoInfo& info, std::uint64_t number) {
  return gst_util_uint64_scale(number, GST_SECOND * info.fps_d, info.fps_n);
}

/// The frame that is on show at \p time.
std::uint64_t frame_at(const GstVideoInfo& info, GstClockTime time) {
  const std::uint64_t number = gst_util_uint64_scale(time, info.fps_n, GST_SECOND * info.fps_d);
  return time_of(info, number + 1) <= time ? number + 1 : number;
}

gboolean set_caps(GstBaseSrc* source, GstCaps* caps) {
  State& state = *RIG_TEST_SRC(source)->state;
  GstVideoInfo info;
  if (!gst_video_info_from_caps(&info, caps) || GST_VIDEO_INFO_FPS_N(&info) <= 0) {
    GST_ELEMENT_ERROR(source, STREAM, FORMAT,
                      ("A rig's camera cannot deliver %" GST_PTR_FORMAT
                       ": raw video with a frame rate above 0 is expected.",
                       static_cast<void*>(caps)),
                      (nullptr));
    return FALSE;
  }
  GST_OBJECT_LOCK(source);
  // A new frame rate goes on at the same time.
  Stream& stream = state.stream;
  if (GST_VIDEO_INFO_FORMAT(&stream.info) != GST_VIDEO_FORMAT_UNKNOWN) {
    const double seconds =
        static_cast<double>(stream.next_frame) * stream.info.fps_d / stream.info.fps_n;
    stream.next_frame =
        static_cast<std::uint64_t>(std::ceil(seconds * info.fps_n / info.fps_d - 1e-9));
  } else {
    stream.next_frame = frame_at(info, stream.wanted_time);
  }
  stream.info = info;
  GST_OBJECT_UNLOCK(source);
  gst_base_src_set_blocksize(source, static_cast<guint>(info.size));
  return TRUE;
}

gboolean negotiate(GstBaseSrc* source) {
  GstPad* pad = GST_BASE_SRC_PAD(source);
  GstCaps* offered = gst_pad_query_caps(pad, nullptr);
  GstCaps* possible = gst_pad_peer_query_caps(pad, offered);
  const bool none = gst_caps_is_empty(possible);
  gst_caps_unref(possible);
  if (none) {
    GstCaps* wanted = gst_pad_peer_query_caps(pad, nullptr);
    gchar* wanted_text = gst_caps_to_string(wanted);
    gchar* offered_text = gst_caps_to_string(offered);
    GST_ELEMENT_ERROR(
        source, STREAM, FORMAT,
        ("What follows does not take the picture of this camera, whose size is the rig's. It "
         "offers %s; wanted is %s.",
         offered_text, wanted_text),
        (nullptr));
    g_free(offered_text);
    g_free(wanted_text);
    gst_caps_unref(wanted);
  }
  gst_caps_unref(offered);
  return !none && GST_BASE_SRC_CLASS(polyhull_rig_test_src_parent_class)->negotiate(source);
}

gboolean decide_allocation(GstBaseSrc* source, GstQuery* query) {
  GstCaps* caps = nullptr;
  gst_query_parse_allocation(query, &caps, nullptr);
  GstVideoInfo info;
  if (caps == nullptr || !gst_video_info_from_caps(&info, caps)) return FALSE;
  GstBufferPool* pool = nullptr;
  guint size = static_cast<guint>(info.size), least = 0, most = 0;
  const bool offered = gst_query_get_n_allocation_pools(query) > 0;
  if (offered) {
    gst_query_parse_nth_allocation_pool(query, 0, &pool, &size, &least, &most);
    size = std::max(size, static_cast<guint>(info.size));
  }
  if (pool == nullptr) pool = gst_video_buffer_pool_new();
  GstStructure* config = gst_buffer_pool_get_config(pool);
  gst_buffer_pool_config_set_params(config, caps, size, least, most);
  if (gst_query_find_allocation_meta(query, GST_VIDEO_META_API_TYPE, nullptr)) {
    gst_buffer_pool_config_add_option(config, GST_BUFFER_POOL_OPTION_VIDEO_META);
  }
  gst_buffer_pool_set_config(pool, config);
  if (offered) {
    gst_query_set_nth_allocation_pool(query, 0, pool, size, least, most);
  } else {
    gst_query_add_allocation_pool(query, pool, size, least, most);
  }
  gst_object_unref(pool);
  return GST_BASE_SRC_CLASS(polyhull_rig_test_src_parent_class)->decide_allocation(source, query);
}

/// A live camera that is late leaves frames out: to the next multiple of a power of two, so that
/// the cameras of a rig, which are late together, leave out the same ones.
std::uint64_t frame_after_lateness(GstBaseSrc* source, const GstVideoInfo& info,
                                   std::uint64_t number) {
  GstClock* clock = gst_element_get_clock(GST_ELEMENT(source));
  if (clock == nullptr) return number;
  const GstClockTime now = gst_clock_get_time(clock),
                     base = gst_element_get_base_time(GST_ELEMENT(source));
  gst_object_unref(clock);
  if (GST_STATE(source) != GST_STATE_PLAYING || now < base) return number;
  const std::uint64_t running =
      gst_segment_to_position(&source->segment, GST_FORMAT_TIME, now - base);
  if (running == GST_CLOCK_TIME_NONE) return number;
  const std::uint64_t due = gst_util_uint64_scale(running, info.fps_n, GST_SECOND * info.fps_d);
  if (due <= number + 1) return number;
  std::uint64_t step = 1;
  while (step < due - number && step < 64) step *= 2;
  return (due + step - 1) / step * step;
}

GstFlowReturn fill(GstPushSrc* push, GstBuffer* buffer) {
  auto* source = GST_BASE_SRC(push);
  State& state = *RIG_TEST_SRC(push)->state;
  Stream& stream = state.stream;
  return guarded(GST_ELEMENT(push), GST_FLOW_ERROR, [&] {
    GST_OBJECT_LOCK(push);
    const GstVideoInfo info = stream.info;
    std::uint64_t number = stream.next_frame;
    GST_OBJECT_UNLOCK(push);
    if (!stream.drawing.picture || GST_VIDEO_INFO_FORMAT(&info) == GST_VIDEO_FORMAT_UNKNOWN)
      return GST_FLOW_NOT_NEGOTIATED;
    if (gst_base_src_is_live(source)) {
      const std::uint64_t later = frame_after_lateness(source, info, number);
      state.statistics.count("frames-skipped", later - number);
      number = later;
    }
    const GstClockTime pts = time_of(info, number), next = time_of(info, number + 1);
    gst_object_sync_values(GST_OBJECT(push), pts);
    Settings settings = snapshot(push, state.settings);
    settings.output = stream.output;

    const auto begin = std::chrono::steady_clock::now();
    const double seconds = settings.start + settings.speed * static_cast<double>(pts) / GST_SECOND;
    stream.drawing.picture->set_time(seconds);
    GstVideoFrame frame;
    if (!gst_video_frame_map(&frame, &info, buffer, GST_MAP_WRITE)) {
      throw Error(Error::Kind::io, "The memory of a buffer cannot be written to.");
    }
    try {
      draw(stream.drawing, settings, number, &frame);
    } catch (...) {
      gst_video_frame_unmap(&frame);
      throw;
    }
    gst_video_frame_unmap(&frame);
    const std::chrono::duration<double, std::milli> spent =
        std::chrono::steady_clock::now() - begin;
    if (stream.mesh_name) {
      write_truth_mesh(truth_mesh(*stream.subject, stream.rig, seconds),
                       stream.mesh_name->name(number));
    }
    state.statistics.count("frames");
    state.statistics.set("last-frame-ms", spent.count());
    const Rectangle& region = stream.drawing.picture->region();
    state.statistics.set_count("subject-pixels",
                               static_cast<std::uint64_t>(region.width) * region.height);

    GST_BUFFER_PTS(buffer) = pts;
    GST_BUFFER_DTS(buffer) = GST_CLOCK_TIME_NONE;
    GST_BUFFER_DURATION(buffer) = next - pts;
    GST_BUFFER_OFFSET(buffer) = number;
    GST_BUFFER_OFFSET_END(buffer) = number + 1;
    GST_OBJECT_LOCK(push);
    stream.next_frame = number + 1;
    GST_OBJECT_UNLOCK(push);
    return GST_FLOW_OK;
  });
}

void get_times(GstBaseSrc* source, GstBuffer* buffer, GstClockTime* begin, GstClockTime* end) {
  *begin = *end = GST_CLOCK_TIME_NONE;
  if (!gst_base_src_is_live(source)) return;
  *begin = GST_BUFFER_PTS(buffer);
  *end = GST_BUFFER_PTS(buffer) + GST_BUFFER_DURATION(buffer);
}

gboolean is_seekable(GstBaseSrc*) {
  return TRUE;
}

gboolean do_seek(GstBaseSrc* source, GstSegment* segment) {
  if (segment->rate < 0.0) {
    GST_WARNING_OBJECT(source, "Playing backwards is not supported.");
    return FALSE;
  }
  State& state = *RIG_TEST_SRC(source)->state;
  segment->time = segment->start;
  GST_OBJECT_LOCK(source);
  Stream& stream = state.stream;
  stream.wanted_time = segment->position;
  if (GST_VIDEO_INFO_FORMAT(&stream.info) != GST_VIDEO_FORMAT_UNKNOWN) {
    stream.next_frame = frame_at(stream.info, segment->position);
  }
  GST_OBJECT_UNLOCK(source);
  return TRUE;
}

gboolean query(GstBaseSrc* source, GstQuery* query) {
  if (GST_QUERY_TYPE(query) == GST_QUERY_CONVERT) {
    State& state = *RIG_TEST_SRC(source)->state;
    GstFormat from, to;
    gint64 value = 0, result = 0;
    gst_query_parse_convert(query, &from, &value, &to, nullptr);
    GST_OBJECT_LOCK(source);
    const GstVideoInfo info = state.stream.info;
    GST_OBJECT_UNLOCK(source);
    if (info.finfo != nullptr && GST_VIDEO_INFO_FORMAT(&info) != GST_VIDEO_FORMAT_UNKNOWN &&
        gst_video_info_convert(&info, from, value, to, &result)) {
      gst_query_set_convert(query, from, value, to, result);
      return TRUE;
    }
    return FALSE;
  }
  return GST_BASE_SRC_CLASS(polyhull_rig_test_src_parent_class)->query(source, query);
}

void finalize(GObject* object) {
  delete RIG_TEST_SRC(object)->state;
  G_OBJECT_CLASS(polyhull_rig_test_src_parent_class)->finalize(object);
}

}  // namespace

static void polyhull_rig_test_src_init(PolyhullRigTestSrc* self) {
  self->state = new State;
  gst_video_info_init(&self->state->stream.info);
  self->state->statistics.declare({"frames", "frames-skipped", "subject-pixels", "warnings"});
  gst_base_src_set_format(GST_BASE_SRC(self), GST_FORMAT_TIME);
  gst_base_src_set_live(GST_BASE_SRC(self), self->state->settings.live);
}

static void polyhull_rig_test_src_class_init(PolyhullRigTestSrcClass* klass) {
  auto* object = G_OBJECT_CLASS(klass);
  auto* element = GST_ELEMENT_CLASS(klass);
  auto* source = GST_BASE_SRC_CLASS(klass);
  GST_DEBUG_CATEGORY_INIT(rigtestsrc_debug, "rigtestsrc", 0, "synthetic camera of a rig");
  object->set_property = set_property_of;
  object->get_property = get_property_of;
  object->finalize = finalize;
  stats_property = install_properties<Settings>(object, rig_test_properties(), first_property);
  g_object_class_install_property(
      object, stats_property,
      statistics_property(
          "Counters since the start: frames, frames-skipped (left out when live and late), "
          "subject-pixels (area of the rectangle around the subject in the last frame), warnings, "
          "last-frame-ms (time to draw the last frame, in milliseconds)."));
  gst_element_class_set_static_metadata(
      element, "Rig test source", "Source/Video",
      "One calibrated camera filming a synthetic person before a coloured screen, "
      "with ground truth",
      "polyhull");
  static const std::string caps = std::string(
      "video/x-raw, format=(string){ RGBx, BGRx, RGBA, BGRA, I420, NV12, "
      "YUY2, UYVY, GRAY8, GRAY16_LE }, width=(int)[1, 16384], "
      "height=(int)[1, 16384], framerate=(fraction)[1/2147483647, "
      "2147483647/1]");
  GstCaps* template_caps = gst_caps_from_string(caps.c_str());
  gst_element_class_add_pad_template(
      element, gst_pad_template_new("src", GST_PAD_SRC, GST_PAD_ALWAYS, template_caps));
  gst_caps_unref(template_caps);
  element->change_state = change_state;
  source->negotiate = negotiate;
  source->get_caps = get_caps;
  source->set_caps = set_caps;
  source->fixate = fixate;
  source->decide_allocation = decide_allocation;
  source->get_times = get_times;
  source->is_seekable = is_seekable;
  source->do_seek = do_seek;
  source->query = query;
  GST_PUSH_SRC_CLASS(klass)->fill = fill;
  gst_type_mark_as_plugin_api(polyhull_rig_test_src_get_type(), static_cast<GstPluginAPIFlags>(0));
}
