// SPDX-License-Identifier: LGPL-2.1-or-later
// composite's output as encoders take it: NV12 and I420.
#include "composite_bench.h"

#include <cstring>
#include <string>
#include <vector>

#include "element_test.h"
#include "render/yuv/yuv_picture.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

using Plane = std::vector<std::uint8_t>;

/// The components of a picture, row by row without gaps: of RGBA the pixels, else Y', Cb, Cr.
std::vector<Plane> components(GstHarness* harness, GstBuffer* buffer) {
  GstCaps* caps = gst_pad_get_current_caps(harness->sinkpad);
  GstVideoInfo info;
  fail_unless(gst_video_info_from_caps(&info, caps));
  gst_caps_unref(caps);
  GstVideoFrame video;
  fail_unless(gst_video_frame_map(&video, &info, buffer, GST_MAP_READ));
  std::vector<Plane> out;
  const bool rgba = GST_VIDEO_INFO_FORMAT(&info) == GST_VIDEO_FORMAT_RGBA;
  for (guint k = 0; k < (rgba ? 1u : 3u); ++k) {
    out.emplace_back();
    const int step = rgba ? 1 : GST_VIDEO_FRAME_COMP_PSTRIDE(&video, k);
    const int across =
        rgba ? 4 * GST_VIDEO_FRAME_WIDTH(&video) : GST_VIDEO_FRAME_COMP_WIDTH(&video, k);
    const auto* data = static_cast<const std::uint8_t*>(GST_VIDEO_FRAME_COMP_DATA(&video, k));
    for (int y = 0; y < GST_VIDEO_FRAME_COMP_HEIGHT(&video, k); ++y)
      for (int x = 0; x < across; ++x)
        out.back().push_back(data[y * GST_VIDEO_FRAME_COMP_STRIDE(&video, k) + x * step]);
  }
  gst_video_frame_unmap(&video);
  return out;
}

std::vector<Plane> converted(const Plane& rgba) {
  std::vector<Plane> out{Plane(width * height), Plane(width * height / 4),
                         Plane(width * height / 4)};
  YuvPicture video;
  video.width = width;
  video.height = height;
  video.y = out[0].data();
  video.cb = out[1].data();
  video.cr = out[2].data();
  video.y_stride = width;
  video.chroma_stride = width / 2;
  write_yuv(rgba.data(), 4 * width, video);
  return out;
}

/// What three frames look like in \p format; the subject comes with the second and moves.
std::vector<std::vector<Plane>> frames_as(const std::string& format, const char* backend) {
  Bench bench;
  bench.wait_for_all();
  gst_util_set_object_arg(G_OBJECT(bench.element), "backend", backend);
  gst_harness_set_sink_caps_str(bench.background, ("video/x-raw,format=" + format).c_str());
  std::vector<std::vector<Plane>> out;
  gst_harness_push(bench.mesh, mesh_buffer(frame_time(1)));
  for (int i = 0; i < 3; ++i) {
    gst_child_proxy_set(GST_CHILD_PROXY(bench.element), "mesh_0::translate-x", 0.1 * i, nullptr);
    GstBuffer* picture = bench.step(opaque_frame(frame_time(i), 32 * i),
                                    i == 0 ? nullptr : mesh_buffer(frame_time(i + 1)));
    fail_unless_equals_uint64(GST_BUFFER_PTS(picture), frame_time(i));
    fail_unless_equals_uint64(GST_BUFFER_DURATION(picture), 40 * GST_MSECOND);
    out.push_back(components(bench.background, picture));
    gst_buffer_unref(picture);
  }
  return out;
}

/// The caps that composite has chosen before \p sink.
std::string caps_before(const std::string& sink) {
  GstElement* pipeline = parse("videotestsrc num-buffers=2 ! " + std::string(background_caps) +
                               " ! mix.background composite name=mix ! " + sink);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  check_ended(wait_for_end(pipeline));
  GstElement* mix = named(pipeline, "mix");
  GstPad* pad = gst_element_get_static_pad(mix, "src");
  GstCaps* caps = gst_pad_get_current_caps(pad);
  gchar* text = gst_caps_to_string(caps);
  const std::string out = text;
  g_free(text);
  gst_caps_unref(caps);
  gst_object_unref(pad);
  stop(pipeline);
  return out;
}

bool has(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

ELEMENT_TEST(video_is_the_picture_converted) {
  for (const char* backend : {"processor", "gl"}) {
    const auto pictures = frames_as("RGBA", backend);
    fail_unless(pictures[0] != pictures[1] && pictures[1] != pictures[2], "nothing was drawn");
    for (const char* format : {"NV12", "I420"}) {
      const auto videos = frames_as(format, backend);
      for (std::size_t i = 0; i < 3; ++i)
        fail_unless(videos[i] == converted(pictures[i][0]), "%s, %s, frame %d", backend, format,
                    static_cast<int>(i));
    }
  }
}

ELEMENT_TEST(a_still_background_is_converted_once) {
  Bench bench(false);
  gst_harness_set_sink_caps_str(bench.background, "video/x-raw,format=NV12");
  GstBuffer* still = frame(0);
  GstMemory* memory = nullptr;
  for (int i = 0; i < 3; ++i) {
    GstBuffer* copy = gst_buffer_copy(still);  // the same memory
    GST_BUFFER_PTS(copy) = frame_time(i);
    gst_harness_push(bench.background, copy);
    GstBuffer* out = bench.pull();
    fail_unless_equals_uint64(GST_BUFFER_PTS(out), frame_time(i));
    if (i == 0) memory = gst_buffer_get_memory(out, 0);
    fail_unless(gst_buffer_peek_memory(out, 0) == memory, "frame %d was copied", i);
    gst_buffer_unref(out);
  }
  fail_unless_equals_uint64(statistic(bench.element, "backgrounds-converted"), 1);
  // Who owns the memory alone may write into it; who shares it gets another one.
  still = gst_buffer_make_writable(still);
  GstMapInfo map;
  fail_unless(gst_buffer_map(still, &map, GST_MAP_WRITE));
  std::memset(map.data, 200, map.size);
  gst_buffer_unmap(still, &map);
  GST_BUFFER_PTS(still) = frame_time(3);
  gst_harness_push(bench.background, still);
  GstBuffer* out = bench.pull();
  fail_unless_equals_uint64(statistic(bench.element, "backgrounds-converted"), 2);
  fail_unless_equals_int(components(bench.background, out)[0][0], 188);  // 16 + 219 * 200 / 255
  fail_unless_equals_uint64(statistic(bench.element, "passed-through"), 4);
  gst_buffer_unref(out);
  gst_memory_unref(memory);
}

ELEMENT_TEST(a_new_size_in_the_stream) {
  Bench bench(false);
  gst_harness_set_sink_caps_str(bench.background, "video/x-raw,format=I420");
  int number = 0;
  for (const auto& [across, down] : {std::pair{64, 48}, {33, 17}, {1, 1}, {64, 48}}) {
    gst_harness_set_src_caps_str(bench.background,
                                 ("video/x-raw,format=RGBA,framerate=25/1,width=" +
                                  std::to_string(across) + ",height=" + std::to_string(down))
                                     .c_str());
    const auto size = static_cast<gsize>(4 * across * down);
    GstBuffer* in = gst_buffer_new_allocate(nullptr, size, nullptr);
    gst_buffer_memset(in, 0, 255, size);
    GST_BUFFER_PTS(in) = frame_time(number++);
    GST_BUFFER_DURATION(in) = 40 * GST_MSECOND;
    gst_harness_push(bench.background, in);
    GstBuffer* out = bench.pull();
    const auto planes = components(bench.background, out);
    fail_unless(planes[0] == Plane(static_cast<std::size_t>(across * down), 235));
    fail_unless(planes[1] == planes[2] &&
                planes[1] ==
                    Plane(static_cast<std::size_t>((across + 1) / 2 * ((down + 1) / 2)), 128));
    gst_buffer_unref(out);
  }
}

ELEMENT_TEST(downstream_chooses) {
  fail_unless(has(caps_before("fakesink"), "format=(string)RGBA"));
  fail_unless(has(caps_before("video/x-raw,format={I420,NV12,RGBA} ! fakesink"), "(string)RGBA"));
  for (const char* format : {"NV12", "I420"}) {
    const std::string caps =
        caps_before(std::string("video/x-raw,format=") + format + " ! fakesink");
    fail_unless(has(caps, format) && has(caps, "bt709") && has(caps, "chroma-site=(string)mpeg2"),
                "%s", caps.c_str());
  }
  fail_unless(has(caps_before("videoconvert ! video/x-raw,format=YUY2 ! fakesink"), "RGBA"));
}

ELEMENT_TEST(a_background_in_opengl_becomes_video) {
  check_ended(run_to_end("videotestsrc num-buffers=2 ! " + std::string(background_caps) +
                         " ! glupload ! mix.background composite name=mix ! "
                         "video/x-raw,format=NV12 ! fakesink"));
}
