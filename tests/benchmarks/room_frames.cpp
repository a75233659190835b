// SPDX-License-Identifier: LGPL-2.1-or-later
#include "room_frames.h"

#include <gst/app/gstappsink.h>
#include <gst/video/video.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "rig/import.h"

namespace polyhull::benchmark {
namespace {

using namespace test;

Picture picture_of(GstSample* sample) {
  GstVideoInfo info;
  gst_video_info_from_caps(&info, gst_sample_get_caps(sample));
  GstVideoFrame frame;
  if (!gst_video_frame_map(&frame, &info, gst_sample_get_buffer(sample), GST_MAP_READ))
    throw std::runtime_error("a frame of the room cannot be mapped");
  Picture out{GST_VIDEO_INFO_WIDTH(&info), GST_VIDEO_INFO_HEIGHT(&info), 4, {}};
  out.pixels.resize(static_cast<std::size_t>(out.width) * out.height * 4);
  for (int y = 0; y < out.height; ++y) {
    const auto* row = static_cast<const std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, 0)) +
                      static_cast<std::ptrdiff_t>(GST_VIDEO_FRAME_PLANE_STRIDE(&frame, 0)) * y;
    std::copy_n(row, 4 * out.width, out.row(y));
  }
  gst_video_frame_unmap(&frame);
  return out;
}

/// These frames of a video, whose clock is even: where it lacks one, the one before it again.
std::vector<Picture> frames_of(const std::string& path, const std::vector<int>& wanted) {
  GstElement* pipeline = gst_parse_launch(
      ("filesrc location=\"" + path +
       "\" ! avidemux ! avdec_mpeg4 ! videorate ! video/x-raw,framerate=50/1 ! videoconvert ! "
       "video/x-raw,format=RGBx ! appsink name=sink sync=false max-buffers=4")
          .c_str(),
      nullptr);
  if (pipeline == nullptr)
    throw std::runtime_error("needs GStreamer's avidemux and avdec_mpeg4 to read " + path);
  GstElement* sink = gst_bin_get_by_name(GST_BIN(pipeline), "sink");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  std::vector<Picture> out;
  for (int i = 0; out.size() < wanted.size(); ++i) {
    GstSample* sample = gst_app_sink_pull_sample(GST_APP_SINK(sink));
    if (sample == nullptr) break;
    if (i == wanted[out.size()]) out.push_back(picture_of(sample));
    gst_sample_unref(sample);
  }
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(sink);
  gst_object_unref(pipeline);
  if (out.size() < wanted.size()) throw std::runtime_error(path + " ends too early");
  return out;
}

SilhouetteSettings keying(Picture plate) {
  SilhouetteSettings settings;
  settings.key.method = KeyMethod::difference;
  settings.key.plate = std::make_shared<const Picture>(std::move(plate));
  settings.key.shadow_darkest = 0.5;
  settings.key.difference_low = 10.0;
  settings.key.difference_high = 28.0;
  settings.key.close = 4.0;
  settings.key.choke = 0.5;
  settings.blur.sigma = 2.0;
  settings.approximate.tolerance = 0.7;
  settings.approximate.keep_largest = 1;
  settings.approximate.min_hole_area = 100.0;
  return settings;
}

}  // namespace

std::vector<RealSet> room_sets(const std::string& data, const std::vector<int>& frames) {
  const std::string folder = data + "/utrecht_voxel/";
  if (!std::filesystem::exists(folder + "calibration_resolved.txt")) return {};
  gst_init(nullptr, nullptr);
  import::Options options;
  options.width = 644;
  options.height = 486;
  const Rig rig = import::text(folder + "calibration_resolved.txt", options);
  constexpr double metres = 0.001;
  std::vector<RealSet> sets;
  for (const int frame : frames)
    sets.push_back({"room-" + std::to_string(frame),
                    {},
                    Bounds{Vec3(-50, -450, -1450) * metres, Vec3(750, 680, 0) * metres}});
  for (const Camera& camera : rig.cameras) {
    const std::string videos = folder + camera.name;
    const SilhouetteSettings settings = keying(frames_of(videos + "/background.avi", {0}).front());
    std::vector<Picture> pictures = frames_of(videos + "/video.avi", frames);
    for (std::size_t i = 0; i < frames.size(); ++i)
      sets[i].views.push_back(keyed(scaled(camera, metres), std::move(pictures[i]), settings));
  }
  return sets;
}

}  // namespace polyhull::benchmark
