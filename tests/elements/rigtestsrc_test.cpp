// SPDX-License-Identifier: LGPL-2.1-or-later
#include <gst/video/video.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <vector>

#include "builtin/default_rig.h"
#include "element_checks.h"
#include "rig/rig.h"
#include "support/folder.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

struct Shot {
  std::vector<std::uint8_t> bytes;
  GstClockTime pts = 0;
  std::uint64_t number = 0;
  std::uint64_t trigger = 0;
};

Shot take(GstSample* sample) {
  Shot shot;
  GstBuffer* buffer = gst_sample_get_buffer(sample);
  GstMapInfo map;
  fail_unless(gst_buffer_map(buffer, &map, GST_MAP_READ));
  shot.bytes.assign(map.data, map.data + map.size);
  gst_buffer_unmap(buffer, &map);
  shot.pts = GST_BUFFER_PTS(buffer);
  shot.number = GST_BUFFER_OFFSET(buffer);
  GstCaps* reference = gst_caps_new_empty_simple("timestamp/x-polyhull-trigger");
  const auto* trigger = gst_buffer_get_reference_timestamp_meta(buffer, reference);
  gst_caps_unref(reference);
  fail_unless(trigger != nullptr, "a frame without a trigger number");
  shot.trigger = trigger->timestamp;
  return shot;
}

/// The next sample of an appsink, null at the end.
GstSample* pull(GstElement* sink) {
  GstSample* sample = nullptr;
  g_signal_emit_by_name(sink, "pull-sample", &sample);
  return sample;
}

GstElement* sink_of(GstElement* pipeline, const char* name = "out") {
  return gst_bin_get_by_name(GST_BIN(pipeline), name);
}

/// The buffers of "rigtestsrc ARGUMENTS ! CAPS".
std::vector<Shot> shoot(const std::string& arguments,
                        const std::string& caps = "video/x-raw,format=RGBA") {
  GstElement* pipeline =
      parse("rigtestsrc " + arguments + " ! " + caps + " ! appsink name=out sync=false");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GstElement* sink = sink_of(pipeline);
  std::vector<Shot> shots;
  while (GstSample* sample = pull(sink)) {
    shots.push_back(take(sample));
    gst_sample_unref(sample);
  }
  gst_object_unref(sink);
  stop(pipeline);
  return shots;
}

const Folder folder;

std::string write_file(const char* name, const std::string& text) {
  const std::string path = folder.file(name);
  std::ofstream(path) << text;
  return path;
}

void expect_error(const std::string& line, const std::string& part) {
  const std::string error = run_to_end(line, 20 * GST_SECOND);
  fail_unless(error.find(part) != std::string::npos, "%s: \"%s\" lacks \"%s\"", line.c_str(),
              error.c_str(), part.c_str());
}

}  // namespace

ELEMENT_TEST(test_documented) {
  check_documented("rigtestsrc");
}

ELEMENT_TEST(test_states) {
  check_states("rigtestsrc output=matte ! fakesink sync=true");
  check_states("rigtestsrc is-live=true output=matte ! fakesink", 6);
}

ELEMENT_TEST(test_buffers_are_numbered_and_timed) {
  const auto shots = shoot("num-buffers=4 output=matte", "video/x-raw,framerate=30000/1001");
  fail_unless_equals_int(shots.size(), 4);
  for (std::uint64_t i = 0; i < 4; ++i) {
    fail_unless_equals_uint64(shots[i].number, i);
    fail_unless_equals_uint64(shots[i].trigger, i);
    fail_unless_equals_uint64(shots[i].pts, gst_util_uint64_scale(i, GST_SECOND * 1001, 30000));
    fail_unless_equals_int(shots[i].bytes.size(), 1024 * 768);
  }
}

ELEMENT_TEST(test_same_bytes_again) {
  const auto once = shoot("camera=cam2 num-buffers=3 noise=3 seed=9");
  const auto again = shoot("camera=cam2 num-buffers=3 noise=3 seed=9");
  const auto other = shoot("camera=cam2 num-buffers=3 noise=3 seed=10");
  for (int i = 0; i < 3; ++i) {
    fail_unless(once[i].bytes == again[i].bytes);
    fail_if(once[i].bytes == other[i].bytes);
  }
  fail_if(once[0].bytes == once[1].bytes);
  const auto still = shoot("speed=0 noise=0 num-buffers=2");
  fail_unless(still[0].bytes == still[1].bytes);
}

/// The qualities differ little.
ELEMENT_TEST(test_quality) {
  for (const char* output : {"matte", "depth"}) {
    // Hair is drawn by the same triangles with both.
    const std::string line = std::string("num-buffers=1 start=2 subject=hairy output=") + output;
    fail_unless(shoot(line, "video/x-raw")[0].bytes ==
                shoot(line + " quality=exact", "video/x-raw")[0].bytes);
  }
  const auto matte = shoot("num-buffers=1 start=2 output=matte", "video/x-raw")[0].bytes;
  const auto true_matte =
      shoot("num-buffers=1 start=2 output=matte quality=exact", "video/x-raw")[0].bytes;
  double more = 0.0, apart = 0.0;
  for (std::size_t i = 0; i < matte.size(); ++i) {
    more += (matte[i] - true_matte[i]) / 255.0;
    apart += std::abs(matte[i] - true_matte[i]) / 255.0;
  }
  // Pixels, of an outline of about 1,500.
  fail_unless(std::abs(more) < 15.0 && apart < 120.0, "%g, %g", more, apart);
  const auto fast = shoot("num-buffers=1 start=2 noise=0")[0].bytes;
  const auto exact = shoot("num-buffers=1 start=2 noise=0 quality=exact")[0].bytes;
  fail_if(fast == exact);
  double squares = 0.0;
  for (std::size_t i = 0; i < fast.size(); ++i)
    squares += std::pow(static_cast<double>(fast[i]) - exact[i], 2.0);
  const double rms = std::sqrt(squares / static_cast<double>(fast.size()));
  fail_unless(rms < 0.65, "rms %g", rms);
}

/// All formats carry the same picture: BGRx is RGBA turned round, the YUV formats agree with each
/// other byte for byte, and what videoconvert makes of them is near the RGBA picture (its fast
/// paths are off by up to three levels; the exact values are tested in the library's yuv test).
ELEMENT_TEST(test_chroma_formats) {
  const std::string arguments = "num-buffers=1 start=6.9 noise=0";
  const auto rgba = shoot(arguments)[0].bytes;
  const auto bgrx = shoot(arguments, "video/x-raw,format=BGRx")[0].bytes;
  // Counted first and judged once: each check writes to a pipe.
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < rgba.size(); i += 4) {
    wrong += rgba[i] != bgrx[i + 2] || rgba[i + 1] != bgrx[i + 1] || rgba[i + 2] != bgrx[i];
  }
  fail_unless_equals_int(wrong, 0);
  constexpr std::size_t pixels = 1024 * 768;
  for (const char* colorimetry : {"bt709", "bt601", "1:4:0:0"}) {
    const auto as = [&](const char* format) {
      return std::string("video/x-raw,format=") + format + ",colorimetry=" + colorimetry;
    };
    const auto i420 = shoot(arguments, as("I420"))[0].bytes,
               nv12 = shoot(arguments, as("NV12"))[0].bytes,
               yuy2 = shoot(arguments, as("YUY2"))[0].bytes,
               uyvy = shoot(arguments, as("UYVY"))[0].bytes;
    for (std::size_t i = 0; i < pixels; ++i) {
      wrong += i420[i] != nv12[i] || i420[i] != yuy2[2 * i] || i420[i] != uyvy[2 * i + 1];
      wrong += yuy2[2 * i + 1] != uyvy[2 * i];
    }
    for (std::size_t i = 0; i < pixels / 4; ++i) {
      wrong += i420[pixels + i] != nv12[pixels + 2 * i];
      wrong += i420[pixels + pixels / 4 + i] != nv12[pixels + 2 * i + 1];
    }
    fail_unless(wrong == 0, "%s: %zu samples differ between formats", colorimetry, wrong);
    for (const char* format : {"I420", "YUY2"}) {
      const auto back = shoot(arguments, as(format) + " ! videoconvert ! video/x-raw,format=RGBA");
      double squares = 0.0;
      for (std::size_t i = 0; i < rgba.size(); ++i) {
        const double d = static_cast<double>(back[0].bytes[i]) - rgba[i];
        squares += i % 4 == 3 ? 0.0 : d * d;
      }
      const double rms = std::sqrt(squares / (3.0 * pixels));
      fail_unless(rms < 5.0, "%s: rms %g", as(format).c_str(), rms);
    }
  }
}

ELEMENT_TEST(test_seek) {
  const auto shots = shoot("num-buffers=60 output=matte", "video/x-raw,framerate=25/1");
  GstElement* pipeline = parse(
      "rigtestsrc output=matte ! video/x-raw,framerate=25/1 ! appsink name=out sync=false "
      "max-buffers=2");
  GstElement* sink = sink_of(pipeline);
  gst_element_set_state(pipeline, GST_STATE_PAUSED);
  fail_unless_equals_int(gst_element_get_state(pipeline, nullptr, nullptr, 10 * GST_SECOND),
                         GST_STATE_CHANGE_SUCCESS);
  for (const int frame : {50, 3, 20}) {
    fail_unless(gst_element_seek(
        pipeline, 1.0, GST_FORMAT_TIME,
        static_cast<GstSeekFlags>(GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE), GST_SEEK_TYPE_SET,
        frame * 40 * GST_MSECOND, GST_SEEK_TYPE_SET, (frame + 3) * 40 * GST_MSECOND));
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
    for (int i = 0; i < 3; ++i) {
      GstSample* sample = pull(sink);
      fail_unless(sample != nullptr);
      const Shot shot = take(sample);
      gst_sample_unref(sample);
      fail_unless_equals_uint64(shot.number, frame + i);
      fail_unless_equals_uint64(shot.trigger, frame + i);
      fail_unless_equals_uint64(shot.pts, (frame + i) * 40 * GST_MSECOND);
      fail_unless(shot.bytes == shots[frame + i].bytes);
    }
    fail_unless(pull(sink) == nullptr, "no end at the seek's stop");
  }
  gst_object_unref(sink);
  stop(pipeline);
}

ELEMENT_TEST(test_live_properties) {
  GstElement* pipeline = parse(
      "rigtestsrc name=src noise=0 shadow=0 speed=0 ! video/x-raw,format=RGBA ! "
      "appsink name=out sync=false max-buffers=1");
  GstElement *sink = sink_of(pipeline), *source = sink_of(pipeline, "src");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  const auto next = [&] {
    GstSample* sample = nullptr;
    for (int i = 0; i < 4; ++i) {  // the queue still holds earlier ones
      if (sample != nullptr) gst_sample_unref(sample);
      sample = pull(sink);
    }
    const Shot shot = take(sample);
    gst_sample_unref(sample);
    return shot.bytes;
  };
  const auto green = next();
  fail_unless(green[1] > green[0] && green[1] > green[2]);
  gst_util_set_object_arg(G_OBJECT(source), "screen", "blue");
  const auto blue = next();
  fail_unless(blue[2] > blue[0] && blue[2] > blue[1]);
  for (const char* name : {"shadow", "spill", "noise", "unevenness"}) {
    g_object_set(source, name, 0.5, nullptr);
    const auto changed = next();
    fail_if(changed == blue, "%s changes nothing", name);
    g_object_set(source, name, 0.0, nullptr);
  }
  fail_unless(statistic(source, "frames") > 4);
  gst_object_unref(source);
  gst_object_unref(sink);
  stop(pipeline);
}

ELEMENT_TEST(test_truth) {
  const auto matte =
      shoot("num-buffers=1 start=2 camera=cam3 output=matte", "video/x-raw")[0].bytes;
  const auto keyed =
      shoot("num-buffers=1 start=2 camera=cam3 output=keyed", "video/x-raw,format=RGBA")[0].bytes;
  const auto depth =
      shoot("num-buffers=1 start=2 camera=cam3 output=depth", "video/x-raw")[0].bytes;
  int covered = 0, wrong = 0;
  for (std::size_t i = 0; i < matte.size(); ++i) {
    wrong += keyed[4 * i + 3] != matte[i];
    const int level = depth[2 * i] + 256 * depth[2 * i + 1];
    wrong += matte[i] == 0 && level != 0;
    if (matte[i] != 255) continue;
    ++covered;
    const double metres = level * 0.0002;
    wrong += !(metres > 1.8 && metres < 4.2);
  }
  fail_unless_equals_int(wrong, 0);
  fail_unless(covered > 10000);
  const std::string pattern = folder.file("rigtestsrc_truth_%03d.ply");
  shoot("num-buffers=2 mesh-location=" + pattern);
  for (const char* name : {"rigtestsrc_truth_000.ply", "rigtestsrc_truth_001.ply"}) {
    fail_unless(std::filesystem::file_size(folder.file(name)) > 100000);
  }
}

ELEMENT_TEST(test_live_keeps_the_time) {
  GstElement* pipeline = parse(
      "rigtestsrc is-live=true num-buffers=10 output=matte ! video/x-raw,framerate=20/1 ! "
      "fakesink sync=false");
  const gint64 begin = g_get_monotonic_time();
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  check_ended(wait_for_end(pipeline));
  const double seconds = static_cast<double>(g_get_monotonic_time() - begin) / 1e6;
  fail_unless(seconds > 0.4, "ten frames at 20 per second took %g s", seconds);
  stop(pipeline);
}

ELEMENT_TEST(test_renegotiation) {
  GstElement* pipeline = parse(
      "rigtestsrc noise=0 ! capsfilter name=filter caps=video/x-raw,format=RGBA ! appsink name=out "
      "sync=false "
      "max-buffers=1");
  GstElement *sink = sink_of(pipeline), *filter = sink_of(pipeline, "filter");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  for (const char* format : {"I420", "BGRx", "NV12", "RGBA"}) {
    GstCaps* caps = gst_caps_new_simple("video/x-raw", "format", G_TYPE_STRING, format, nullptr);
    g_object_set(filter, "caps", caps, nullptr);
    gst_caps_unref(caps);
    bool seen = false;
    for (int i = 0; i < 20 && !seen; ++i) {
      GstSample* sample = pull(sink);
      fail_unless(sample != nullptr);
      const gchar* now = gst_structure_get_string(
          gst_caps_get_structure(gst_sample_get_caps(sample), 0), "format");
      seen = g_str_equal(now, format);
      gst_sample_unref(sample);
    }
    fail_unless(seen, "%s never came", format);
  }
  gst_object_unref(filter);
  gst_object_unref(sink);
  stop(pipeline);
}

ELEMENT_TEST(test_sample_outlives_the_element) {
  GstElement* pipeline = parse("rigtestsrc ! appsink name=out sync=false max-buffers=1");
  GstElement* sink = sink_of(pipeline);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GstSample* sample = pull(sink);
  gst_object_unref(sink);
  stop(pipeline);
  fail_unless(take(sample).bytes.size() > 100000);
  gst_sample_unref(sample);
}

ELEMENT_TEST(test_bad_input) {
  expect_error("rigtestsrc camera=nobody ! fakesink", "cam0, cam1, cam2, cam3");
  expect_error("rigtestsrc rig=/nowhere/rig.json ! fakesink", "/nowhere/rig.json");
  const std::string text = write_file("rigtestsrc_text.json", "this is a letter");
  expect_error("rigtestsrc rig=" + text + " ! fakesink", "rigtestsrc_text.json");
  std::string json = rig_to_json(default_rig());
  json.replace(json.find("\"version\": 1"), 12, "\"version\": 7");
  const std::string version = write_file("rigtestsrc_version.json", json);
  expect_error("rigtestsrc rig=" + version + " ! fakesink", "version");
  expect_error("rigtestsrc subject=/nowhere/none.obj ! fakesink", "/nowhere/none.obj");
  expect_error("rigtestsrc subject=" + text + " ! fakesink", "rigtestsrc_text.json");
  expect_error("rigtestsrc mesh-location=/nowhere/mesh-%d.ply ! fakesink", "/nowhere/mesh-0.ply");
  expect_error("rigtestsrc mesh-location=/tmp/mesh-%s.ply ! fakesink", "mesh-%s.ply");
  expect_error("rigtestsrc ! video/x-raw,width=640 ! fakesink", "1024");
  // Half a tetrahedron is shown, with a warning.
  const std::string open =
      write_file("rigtestsrc_open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 3 2 1\nf 1 3 2\n");
  GstElement* pipeline = parse("rigtestsrc name=src num-buffers=2 subject=" + open + " ! fakesink");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GstBus* bus = gst_element_get_bus(pipeline);
  GstMessage* message = gst_bus_timed_pop_filtered(bus, 10 * GST_SECOND, GST_MESSAGE_WARNING);
  fail_unless(message != nullptr, "no warning about an open surface");
  gst_message_unref(message);
  gst_object_unref(bus);
  check_ended(wait_for_end(pipeline));
  stop(pipeline);
}

/// A rig from a file, in millimetres with z up, sees the figure where the built-in rig sees it.
ELEMENT_TEST(test_rig_file_in_other_units) {
  Rig rig = default_rig();
  const Mat3 to_z_up(Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(0, -1, 0));
  for (Camera& camera : rig.cameras) {
    camera.R = camera.R * glm::transpose(to_z_up);
    camera.t *= 1000.0;
  }
  rig.unit = "mm";
  rig.up = Vec3(0, 0, 1);
  rig.bounds.reset();
  const std::string path = write_file("rigtestsrc_rig.json", rig_to_json(rig));
  const auto own = shoot("num-buffers=1 camera=cam1 output=matte", "video/x-raw");
  const auto file = shoot("num-buffers=1 camera=cam1 output=matte rig=" + path, "video/x-raw");
  int different = 0;
  for (std::size_t i = 0; i < own[0].bytes.size(); ++i) {
    different += std::abs(own[0].bytes[i] - file[0].bytes[i]) > 8;
  }
  fail_unless(different < 5, "%d pixels differ", different);
}

/// Before, its triangles were split for minutes.
ELEMENT_TEST(test_a_distortion_that_no_lens_has_is_left_out) {
  Rig rig = default_rig();
  rig.cameras[2].distortion = {0.0, 688564.6, 980472.6, 600565.4};
  const std::string path = write_file("rigtestsrc_lens.json", rig_to_json(rig));
  const auto own = shoot("num-buffers=1 camera=cam2 output=matte", "video/x-raw");
  const auto file = shoot("num-buffers=1 camera=cam2 output=matte rig=" + path, "video/x-raw");
  fail_unless(own[0].bytes == file[0].bytes);
}
