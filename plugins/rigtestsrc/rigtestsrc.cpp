// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// rigtestsrc: one camera of a rig, filming a synthetic person before a green or blue screen.
///
/// What videotestsrc is to video, rigtestsrc is to a studio of calibrated cameras. Each element is
/// one camera of a rig; all of them show the same instant of the same subject for the same
/// timestamp, and carry the same trigger number, as cameras behind one trigger do.
/// The subject is a walking, waving figure, or any closed surface from an OBJ file. `unevenness`,
/// `shadow`, `spill` and `noise` spoil the picture as a real studio does; chroma subsampling comes
/// with the negotiated format. The truth is there to compare with: `output=matte`, `output=depth`
/// and `mesh-location`.
#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "base/error.h"
#include "base/stopwatch.h"
#include "base/thread_pool.h"
#include "builtin/default_rig.h"
#include "mesh/view.h"
#include "plugins/common/memory/video_frame.h"
#include "plugins/common/trigger.h"
#include "plugins/rigtestsrc/private.h"
#include "rig/lens.h"

GST_DEBUG_CATEGORY_STATIC(rigtestsrc_debug);
#define GST_CAT_DEFAULT rigtestsrc_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

int find_camera(const Rig& rig, const RigTestSettings& settings) {
  if (settings.camera.empty()) return 0;
  std::string names;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    if (rig.cameras[i].name == settings.camera) return static_cast<int>(i);
    names += (i ? ", " : "") + rig.cameras[i].name;
  }
  throw Error(Error::Kind::not_found,
              "The rig {} has no camera called '{}'. Set camera to one of its ({}).",
              settings.rig.empty() ? "built in" : "'" + settings.rig + "'", settings.camera, names);
}

GstFlowReturn fill(GstPushSrc* push, GstBuffer* buffer) {
  RigTestSrc& self = state_of<RigTestSrc>(push);
  RigTestStream& stream = self.stream;
  return guarded(GST_ELEMENT(push), GST_FLOW_ERROR, [&] {
    const GstVideoInfo info = snapshot(push, self.info);
    if (!stream.drawing.picture || GST_VIDEO_INFO_FORMAT(&info) == GST_VIDEO_FORMAT_UNKNOWN)
      return GST_FLOW_NOT_NEGOTIATED;
    const FrameClock::Frame next = self.clock.next();
    self.statistics.count("frames-skipped", next.late);
    self.statistics.count("frames-unwanted", next.unwanted);
    gst_object_sync_values(GST_OBJECT(push), next.time);
    RigTestSettings settings = snapshot(push, self.settings);
    settings.output = stream.output;

    const Stopwatch watch;
    const LoopWatch loops;
    const double seconds =
        settings.start + settings.speed * static_cast<double>(next.time) / GST_SECOND;
    stream.drawing.picture->set_time(seconds);
    draw(stream.drawing, settings, next.number, MappedFrame(info, buffer, GST_MAP_WRITE).frame());
    self.statistics.set("last-frame-ms", watch.milliseconds());
    if (stream.mesh_name) {
      write_truth_mesh(truth_mesh(*stream.subject, stream.rig, seconds),
                       stream.mesh_name->name(next.number));
    }
    self.statistics.count("frames");
    self.statistics.set("threads-used", loops.threads());
    const Rectangle& region = stream.drawing.picture->region();
    self.statistics.set_count("subject-pixels",
                              static_cast<std::uint64_t>(region.width) * region.height);

    self.clock.finish(next, buffer);
    attach_trigger(buffer, next.number, no_time);
    return GST_FLOW_OK;
  });
}

}  // namespace

namespace polyhull::element {

RigTestSrc::RigTestSrc(gpointer object) : FrameSource(object) {
  statistics.declare({"frames", "frames-skipped", "frames-unwanted", "subject-pixels", "warnings"});
  gst_base_src_set_live(GST_BASE_SRC(object), settings.live);
}

void RigTestSrc::property_set(gpointer object, std::string_view name) {
  FrameClock::Delay delay;
  bool live = false;
  {
    const ObjectLock lock(object);
    delay = {settings.delay, settings.jitter, stream.camera_seed + settings.seed};
    live = settings.live;
  }
  if (name == "is-live") gst_base_src_set_live(GST_BASE_SRC(object), live);
  clock.set_delay(delay);
}

/// Opens rig and subject.
void RigTestSrc::open(GstElement* element) {
  const RigTestSettings now = snapshot(element, settings);
  RigTestStream opened;
  opened.rig = open_rig(now.rig);
  const int camera = find_camera(opened.rig, now);
  const double lost = lost_share(opened.rig.cameras[static_cast<std::size_t>(camera)]);
  if (lost > most_lost) opened.rig.cameras[static_cast<std::size_t>(camera)].distortion.clear();
  opened.subject = open_subject(now.subject, now.subject_height);
  opened.output = now.output;
  opened.drawing.metres_per_unit = opened.rig.metres_per_unit();
  if (!now.mesh_location.empty())
    opened.mesh_name = std::make_unique<NumberedName>(now.mesh_location);
  opened.drawing.picture =
      std::make_unique<CameraPicture>(opened.rig, camera, opened.subject, now.quality);
  prepare(opened.drawing, now);
  opened.camera_seed = static_cast<std::uint64_t>(camera) << 32;
  clock.set_delay({now.delay, now.jitter, opened.camera_seed + now.seed});
  start(element);
  statistics.reset();
  if (!opened.subject->warning().empty())
    statistics.warn(element, "warnings", opened.subject->warning());
  if (lost > most_lost)
    statistics.warn(
        element, "warnings",
        fmt::format("The distortion of camera '{}' is no lens's: it turns back within the picture, "
                    "{:.0f} % of which it has no place for. The picture is drawn without it. Look "
                    "at the rig's coefficients and their order (k1 k2 p1 p2 k3 …).",
                    opened.rig.cameras[static_cast<std::size_t>(camera)].name, 100.0 * lost));
  const ObjectLock lock(element);
  stream = std::move(opened);
}

void RigTestSrc::close(GstElement* element) {
  RigTestStream old;  // deleted without the lock
  const ObjectLock lock(element);
  std::swap(old, stream);
}

void RigTestSrc::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(rigtestsrc_debug, "rigtestsrc", 0, "synthetic camera of a rig");
  add_properties<RigTestSrc>(klass, rig_test_properties(), &RigTestSrc::settings);
  add_statistics<RigTestSrc>(
      klass,
      "Counters since the start: frames, frames-skipped (left out when live and late), "
      "frames-unwanted (left out because what follows cannot keep up), "
      "subject-pixels (area of the rectangle around the subject in the last frame), warnings, "
      "last-frame-ms (time to draw the last frame, in milliseconds), threads-used (how many "
      "threads took part in its parallel loops, on average).");
  set_metadata(klass, "Rig test source", "Source/Video",
               "One calibrated camera filming a synthetic person before a coloured screen, with "
               "ground truth");
  add_template(klass, "src", GST_PAD_SRC,
               "video/x-raw, format=(string){ RGBx, BGRx, RGBA, BGRA, I420, NV12, YUY2, UYVY, "
               "GRAY8, GRAY16_LE }, width=(int)[1, 16384], height=(int)[1, 16384], "
               "framerate=(fraction)[1/2147483647, 2147483647/1]");
  install_frame_source<RigTestSrc>(klass);
  GstBaseSrcClass* source = GST_BASE_SRC_CLASS(klass);
  source->negotiate = rig_test_negotiate;
  source->get_caps = rig_test_get_caps;
  source->fixate = rig_test_fixate;
  source->decide_allocation = rig_test_decide_allocation;
  GST_PUSH_SRC_CLASS(klass)->fill = fill;
}

}  // namespace polyhull::element

GST_ELEMENT_REGISTER_DEFINE(rigtestsrc, "rigtestsrc", GST_RANK_NONE, type_of<RigTestSrc>())
