// SPDX-License-Identifier: LGPL-2.1-or-later
/**
 * SECTION:element-rigtestsrc
 * @title: rigtestsrc
 * @short_description: One camera of a rig, filming a synthetic person before a green or blue screen
 *
 * What videotestsrc is to video, rigtestsrc is to a studio of calibrated cameras. Each element is
 * one camera of a rig; all of them show the same instant of the same subject for the same
 * timestamp, and carry the same trigger number, as cameras behind one trigger do.
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
#include "plugins/rigtestsrc/rigtestsrc.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <vector>

#include "base/error.h"
#include "mesh/view.h"
#include "plugins/common/guard.h"
#include "plugins/common/trigger.h"
#include "plugins/rigtestsrc/private.h"
#include "studio/cameras/default_rig.h"

GST_DEBUG_CATEGORY_STATIC(rigtestsrc_debug);
#define GST_CAT_DEFAULT rigtestsrc_debug

using namespace polyhull;
using namespace polyhull::element;

G_DEFINE_TYPE(PolyhullRigTestSrc, polyhull_rig_test_src, GST_TYPE_PUSH_SRC)

GST_ELEMENT_REGISTER_DEFINE(rigtestsrc, "rigtestsrc", GST_RANK_NONE,
                            polyhull_rig_test_src_get_type())

namespace {

GstBaseSrcClass* parent_class() {
  return GST_BASE_SRC_CLASS(polyhull_rig_test_src_parent_class);
}

constexpr guint first_property = 1;
guint stats_property = 0;

void set_property_of(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  RigTestState& state = *RIG_TEST_SRC(object)->state;
  if (!set_property<RigTestSettings>(object, rig_test_properties(), first_property, state.settings,
                                     id, value)) {
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
    return;
  }
  if (g_str_equal(spec->name, "is-live")) {
    gst_base_src_set_live(GST_BASE_SRC(object), g_value_get_boolean(value));
  }
  GST_OBJECT_LOCK(object);
  const FrameClock::Delay delay{state.settings.delay, state.settings.jitter,
                                state.stream.camera_seed + state.settings.seed};
  GST_OBJECT_UNLOCK(object);
  state.clock.set_delay(delay);
}

void get_property_of(GObject* object, guint id, GValue* value, GParamSpec* spec) {
  RigTestState& state = *RIG_TEST_SRC(object)->state;
  if (id == stats_property) {
    g_value_take_boxed(value, state.statistics.structure());
  } else if (!get_property<RigTestSettings>(object, rig_test_properties(), first_property,
                                            state.settings, id, value)) {
    G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  }
}

int find_camera(const Rig& rig, const RigTestSettings& settings) {
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
  RigTestState& state = *RIG_TEST_SRC(source)->state;
  const RigTestSettings settings = snapshot(source, state.settings);
  return guarded(GST_ELEMENT(source), FALSE, [&] {
    RigTestStream stream;
    stream.rig = open_rig(settings.rig);
    const int camera = find_camera(stream.rig, settings);
    stream.subject = open_subject(settings.subject, settings.subject_height);
    stream.output = settings.output;
    stream.drawing.metres_per_unit = stream.rig.metres_per_unit();
    if (!settings.mesh_location.empty()) {
      stream.mesh_name = std::make_unique<NumberedName>(settings.mesh_location);
    }
    stream.drawing.picture = std::make_unique<CameraPicture>(stream.rig, camera, stream.subject);
    stream.camera_seed = static_cast<std::uint64_t>(camera) << 32;
    state.clock.set_delay({settings.delay, settings.jitter, stream.camera_seed + settings.seed});
    gst_video_info_init(&stream.info);
    state.clock.reset();
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
  RigTestState& state = *RIG_TEST_SRC(source)->state;
  GST_OBJECT_LOCK(source);
  RigTestStream old = std::move(state.stream);
  state.stream = RigTestStream{};
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

GstFlowReturn fill(GstPushSrc* push, GstBuffer* buffer) {
  RigTestState& state = *RIG_TEST_SRC(push)->state;
  RigTestStream& stream = state.stream;
  return guarded(GST_ELEMENT(push), GST_FLOW_ERROR, [&] {
    const GstVideoInfo info = snapshot(push, stream.info);
    if (!stream.drawing.picture || GST_VIDEO_INFO_FORMAT(&info) == GST_VIDEO_FORMAT_UNKNOWN)
      return GST_FLOW_NOT_NEGOTIATED;
    const FrameClock::Frame next = state.clock.next();
    state.statistics.count("frames-skipped", next.late);
    state.statistics.count("frames-unwanted", next.unwanted);
    gst_object_sync_values(GST_OBJECT(push), next.time);
    RigTestSettings settings = snapshot(push, state.settings);
    settings.output = stream.output;

    const auto begin = std::chrono::steady_clock::now();
    const double seconds = settings.start + settings.speed * static_cast<double>(next.time) / GST_SECOND;
    stream.drawing.picture->set_time(seconds);
    GstVideoFrame frame;
    if (!gst_video_frame_map(&frame, &info, buffer, GST_MAP_WRITE)) {
      throw Error(Error::Kind::io, "The memory of a buffer cannot be written to.");
    }
    try {
      draw(stream.drawing, settings, next.number, &frame);
    } catch (...) {
      gst_video_frame_unmap(&frame);
      throw;
    }
    gst_video_frame_unmap(&frame);
    const std::chrono::duration<double, std::milli> spent =
        std::chrono::steady_clock::now() - begin;
    if (stream.mesh_name) {
      write_truth_mesh(truth_mesh(*stream.subject, stream.rig, seconds),
                       stream.mesh_name->name(next.number));
    }
    state.statistics.count("frames");
    state.statistics.set("last-frame-ms", spent.count());
    const Rectangle& region = stream.drawing.picture->region();
    state.statistics.set_count("subject-pixels",
                               static_cast<std::uint64_t>(region.width) * region.height);

    state.clock.finish(next, buffer);
    attach_trigger(buffer, next.number, no_time);
    return GST_FLOW_OK;
  });
}

gboolean is_seekable(GstBaseSrc*) {
  return TRUE;
}

FrameClock& clock_of(GstBaseSrc* source) {
  return RIG_TEST_SRC(source)->state->clock;
}

gboolean event(GstBaseSrc* source, GstEvent* event) {
  if (clock_of(source).hear(event)) return TRUE;
  return GST_BASE_SRC_CLASS(polyhull_rig_test_src_parent_class)->event(source, event);
}

gboolean query(GstBaseSrc* source, GstQuery* query) {
  RigTestState& state = *RIG_TEST_SRC(source)->state;
  if (GST_QUERY_TYPE(query) == GST_QUERY_LATENCY) return state.clock.answer_latency(query);
  if (GST_QUERY_TYPE(query) == GST_QUERY_CONVERT) {
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
  self->state = new RigTestState(GST_BASE_SRC(self));
  gst_video_info_init(&self->state->stream.info);
  self->state->statistics.declare({"frames", "frames-skipped", "frames-unwanted", "subject-pixels", "warnings"});
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
  stats_property =
      install_properties<RigTestSettings>(object, rig_test_properties(), first_property);
  g_object_class_install_property(
      object, stats_property,
      statistics_property(
          "Counters since the start: frames, frames-skipped (left out when live and late), "
          "frames-unwanted (left out because what follows cannot keep up), "
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
  source->negotiate = [](GstBaseSrc* self) { return rig_test_negotiate(self, parent_class()); };
  source->get_caps = rig_test_get_caps;
  source->set_caps = rig_test_set_caps;
  source->fixate = [](GstBaseSrc* self, GstCaps* caps) {
    return rig_test_fixate(self, caps, parent_class());
  };
  source->decide_allocation = [](GstBaseSrc* self, GstQuery* query) {
    return rig_test_decide_allocation(self, query, parent_class());
  };
  source->get_times = [](GstBaseSrc* self, GstBuffer* buffer, GstClockTime* begin,
                         GstClockTime* end) { clock_of(self).get_times(buffer, begin, end); };
  source->is_seekable = is_seekable;
  source->do_seek = [](GstBaseSrc* self, GstSegment* segment) -> gboolean {
    return clock_of(self).seek(segment);
  };
  source->event = event;
  source->query = query;
  GST_PUSH_SRC_CLASS(klass)->fill = fill;
  gst_type_mark_as_plugin_api(polyhull_rig_test_src_get_type(), static_cast<GstPluginAPIFlags>(0));
}
