// SPDX-License-Identifier: LGPL-2.1-or-later
// A GigE Vision camera in software: Aravis' fake camera on one network interface, with rigtestsrc's
// numbered pictures in its sensor, as BayerRG8. It exposes at whole periods of the machine's monotonic
// time, so that several of them see the same instants, as cameras on one trigger do, whenever they
// were started; the number on the label is the instant's. It runs until it is ended.
#include <arv.h>
#include <gst/app/gstappsink.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "builtin/stamp.h"
#include "command_line.h"
#include "support/live_line.h"

namespace {

constexpr int width = 320, height = 240, rate = 25;  // as line.cpp asks for
constexpr int pictures = 128;  // that come in turn: sets mixed by 5.12 s would not be noticed
constexpr gint64 period = G_USEC_PER_SEC / rate;
constexpr gint64 most_late = 10000;  // us that a busy machine may make an exposure late

struct Sensor {
  ArvFakeCamera* camera = nullptr;
  std::vector<std::vector<std::uint8_t>> mosaics;
  std::vector<std::uint8_t> between;  // a black picture, for exposures of no instant
  gint64 late = 0;                    // us that it exposes later than the others
};

/// Draws the label of \p number larger over rigtestsrc's, so that a mosaic does not blur it.
void label(GstVideoFrame& frame, int number) {
  auto* rows = static_cast<std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, 0));
  const int stride = GST_VIDEO_FRAME_PLANE_STRIDE(&frame, 0);
  int left = width, right = 0, top = height, bottom = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const std::uint8_t* pixel = rows + y * stride + 4 * x;
      if (pixel[0] != 255 || pixel[1] != 0 || pixel[2] != 255) continue;
      left = std::min(left, x);
      right = std::max(right, x);
      top = std::min(top, y);
      bottom = std::max(bottom, y);
    }
  const int size = 264, x = (left + right + 1) / 2, y = (top + bottom + 1) / 2;
  polyhull::draw_stamp(static_cast<std::uint16_t>(number),
                       {x - size / 2, y - size * 2 / 5, size, size}, rows, stride, width, height);
}

/// Rows of red, green and green, blue pixels, as a sensor behind such a filter sees them.
std::vector<std::uint8_t> mosaic_of(const GstVideoFrame& frame) {
  std::vector<std::uint8_t> mosaic(static_cast<std::size_t>(width) * height);
  const auto* rows = static_cast<const std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, 0));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      mosaic[y * width + x] =
          rows[y * GST_VIDEO_FRAME_PLANE_STRIDE(&frame, 0) + 4 * x + x % 2 + y % 2];
  return mosaic;
}

/// Draws what the camera will see; false, and says so, where that fails.
bool draw(const std::string& camera, Sensor& sensor) {
  const std::string line =
      "rigtestsrc rig=" +
      polyhull::test::ring_rig({.cameras = 4, .width = width, .height = height}) +
      " camera=" + camera + " num-buffers=" + std::to_string(pictures) +
      " stamp=true shadow=0 unevenness=0 noise=0 spill=0 ! video/x-raw,format=RGBx,width=" +
      std::to_string(width) + ",height=" + std::to_string(height) +
      ",framerate=" + std::to_string(rate) + "/1 ! appsink name=out sync=false";
  GError* error = nullptr;
  GstElement* pipeline = gst_parse_launch(line.c_str(), &error);
  if (error != nullptr) {
    std::fprintf(stderr, "fake_camera: %s\n", error->message);
    return false;
  }
  GstElement* sink = gst_bin_get_by_name(GST_BIN(pipeline), "out");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  while (GstSample* sample = gst_app_sink_pull_sample(GST_APP_SINK(sink))) {
    GstBuffer* buffer = gst_buffer_copy_deep(gst_sample_get_buffer(sample));
    GstVideoInfo info;
    GstVideoFrame frame;
    gst_video_info_from_caps(&info, gst_sample_get_caps(sample));
    if (gst_video_frame_map(&frame, &info, buffer, GST_MAP_READWRITE)) {
      label(frame, static_cast<int>(sensor.mosaics.size()));
      sensor.mosaics.push_back(mosaic_of(frame));

      gst_video_frame_unmap(&frame);
    }
    gst_buffer_unref(buffer);
    gst_sample_unref(sample);
  }
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(sink);
  gst_object_unref(pipeline);
  if (sensor.mosaics.size() == pictures) {
    sensor.between.assign(sensor.mosaics[0].size(), 0);
    return true;
  }
  std::fprintf(stderr, "fake_camera: %zu pictures of %d drawn\n", sensor.mosaics.size(), pictures);
  return false;
}

void expose(ArvBuffer* buffer, void* data, guint32, guint32, ArvPixelFormat format) {
  const auto& sensor = *static_cast<const Sensor*>(data);
  if (sensor.late > 0) g_usleep(sensor.late);
  const gint64 now = g_get_real_time() - sensor.late;
  const std::vector<std::uint8_t>& mosaic =
      now % period < most_late ? sensor.mosaics[static_cast<std::size_t>(now / period) % pictures]
                               : sensor.between;
  // What a client gets that asks for another format or size is no picture of an instant. The buffer's
  // own size is not set yet.
  if (format == ARV_PIXEL_FORMAT_BAYER_RG_8 &&
      arv_fake_camera_get_payload(sensor.camera) == mosaic.size())
    std::copy(mosaic.begin(), mosaic.end(),
              static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, nullptr))));
}

}  // namespace

/// In GLib's place, for Aravis' camera, too: a camera's clock is not set while it runs, as the machine's
/// may be; and several of them have the same, as if by PTP.
extern "C" gint64 g_get_real_time() {
  return g_get_monotonic_time();
}

int main(int argc, char** argv) {
  gst_init(&argc, &argv);
  std::string interface, camera = "cam0";
  Sensor sensor;
  polyhull::CommandLine command(
      "fake_camera", "A GigE Vision camera in software, with rigtestsrc's numbered pictures");
  command.option("--interface", &interface, "network interface or address").required();
  command.option("--camera", &camera, "which of the ring's, cam0 to cam3, also its serial number");
  command.option("--late", &sensor.late, "us that it exposes later than other such cameras")
      .range(0, static_cast<int>(period / 2));
  if (const auto status = command.parse(argc, argv)) return *status;
  if (!draw(camera, sensor)) return 1;

  ArvGvFakeCamera* server = arv_gv_fake_camera_new(interface.c_str(), camera.c_str());
  if (server == nullptr || !arv_gv_fake_camera_is_running(server)) {
    std::fprintf(stderr, "fake_camera: no camera can be made on '%s'\n", interface.c_str());
    return 1;
  }
  sensor.camera = arv_gv_fake_camera_get_fake_camera(server);
  arv_fake_camera_set_fill_pattern(sensor.camera, expose, &sensor);
  std::printf("ready\n");
  std::fflush(stdout);
  g_main_loop_run(g_main_loop_new(nullptr, FALSE));
}
