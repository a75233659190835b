// SPDX-License-Identifier: LGPL-2.1-or-later
// composite's background as decoders give it: the composite is that of the same background converted to
// RGBA by videoconvert.
#include <cstdlib>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "composite_bench.h"
#include "element_test.h"
#include "played.h"
#include "support/folder.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

using Pixels = std::vector<std::uint8_t>;

std::string caps_of(const std::string& format, int across = width, int down = height) {
  return "video/x-raw,format=" + format + ",framerate=25/1,width=" + std::to_string(across) +
         ",height=" + std::to_string(down);
}

GstVideoInfo info_of(const std::string& caps) {
  GstVideoInfo info;
  g_autoptr(GstCaps) parsed = gst_caps_from_string(caps.c_str());
  fail_unless(gst_video_info_from_caps(&info, parsed), "%s", caps.c_str());
  return info;
}

/// Any bytes: the frame \p i of \p caps.
GstBuffer* noise(const std::string& caps, int i = 0) {
  const GstVideoInfo info = info_of(caps);
  GstBuffer* buffer = gst_buffer_new_allocate(nullptr, info.size, nullptr);
  GstMapInfo map;
  fail_unless(gst_buffer_map(buffer, &map, GST_MAP_WRITE));
  std::minstd_rand random(static_cast<unsigned>(i + 1));
  for (gsize k = 0; k < map.size; ++k) map.data[k] = static_cast<std::uint8_t>(random() >> 8);
  gst_buffer_unmap(buffer, &map);
  GST_BUFFER_PTS(buffer) = frame_time(i);
  GST_BUFFER_DURATION(buffer) = 40 * GST_MSECOND;
  return buffer;
}

/// \p frame, which is given up, as videoconvert makes RGBA of it.
GstBuffer* by_videoconvert(const std::string& caps, GstBuffer* frame) {
  GstHarness* harness =
      gst_harness_new_parse("videoconvert ! capsfilter caps=video/x-raw,format=RGBA");
  gst_harness_set_src_caps_str(harness, caps.c_str());
  GstBuffer* out = gst_harness_push_and_pull(harness, frame);
  fail_unless(out != nullptr, "%s", caps.c_str());
  gst_harness_teardown(harness);
  return out;
}

int largest_difference(const Pixels& a, const Pixels& b) {
  fail_unless_equals_uint64(a.size(), b.size());
  int largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

/// Three composites of \p caps, of frames that come in RGBA already or not, the subject in all.
std::vector<Pixels> composites(const std::string& caps, const char* backend, bool converted,
                               const char* output) {
  Bench bench;
  bench.wait_for_all();
  gst_util_set_object_arg(G_OBJECT(bench.element), "backend", backend);
  gst_harness_set_sink_caps_str(bench.background, output);
  if (!converted) gst_harness_set_src_caps_str(bench.background, caps.c_str());
  gst_harness_push(bench.mesh, mesh_buffer(0));
  std::vector<Pixels> out;
  for (int i = 0; i < 3; ++i) {
    GstBuffer* frame = noise(caps, i);
    if (converted) frame = by_videoconvert(caps, frame);
    out.push_back(bytes_taken(bench.step(frame, mesh_buffer(frame_time(i + 1)))));
  }
  fail_unless(statistic(bench.element, "pixels-changed") > 0);
  return out;
}

struct Passing : Bench {
  Passing() : Bench(false) {}
  GstBuffer* pass(GstBuffer* frame) {
    gst_harness_push(background, frame);
    return pull();
  }
  guint64 converted() const { return statistic(element, "backgrounds-converted"); }
};

}  // namespace

// One stream, whose format changes with each frame.
ELEMENT_TEST(every_format_is_as_videoconvert_makes_it) {
  std::vector<std::string> all;
  g_autoptr(GstCaps) listed = gst_caps_from_string("video/x-raw,format=" GST_VIDEO_FORMATS_ALL);
  const GValue* formats = gst_structure_get_value(gst_caps_get_structure(listed, 0), "format");
  // Of odd widths, GStreamer reads past the rows of some packed ones.
  for (guint i = 0; i < gst_value_list_get_size(formats); ++i)
    all.push_back(caps_of(g_value_get_string(gst_value_list_get_value(formats, i)), 48, 17));
  for (const char* colours : {"bt601", "bt709", "bt2020", "1:4:0:0"})
    for (const char* site : {"mpeg2", "jpeg"})
      for (const char* format : {"NV12", "I420", "Y444"})
        all.push_back(caps_of(format, 35, 19) + ",colorimetry=" + colours + ",chroma-site=" + site);
  for (const char* format : {"NV12", "YV12", "BGRx", "RGBx", "BGRA"})
    all.push_back(caps_of(format, 1, 1));
  Passing bench;
  int number = 0;
  for (const std::string& caps : all) {
    gst_harness_set_src_caps_str(bench.background, caps.c_str());
    GstBuffer* frame = noise(caps, number);
    const Pixels wanted = bytes_taken(by_videoconvert(caps, gst_buffer_copy_deep(frame)));
    GstBuffer* out = bench.pass(frame);
    fail_unless_equals_uint64(GST_BUFFER_PTS(out), frame_time(number));
    fail_unless_equals_uint64(GST_BUFFER_DURATION(out), 40 * GST_MSECOND);
    const int off = largest_difference(bytes_taken(out), wanted);
    fail_unless(off <= 1, "%s: %d levels", caps.c_str(), off);
    ++number;
  }
  fail_unless(bench.converted() + 2 > all.size());  // RGBA is listed once
}

ELEMENT_TEST(the_composite_is_that_of_the_converted_background) {
  const struct {
    const char *format, *backend, *output;
  } cases[] = {{"NV12", "processor", "RGBA"},
               {"I420", "processor", "NV12"},
               {"BGRA", "processor", "RGBA"},
               {"BGRA", "processor", "I420"},
               {"NV12", "gl", "RGBA"}};
  for (const auto& [format, backend, output] : cases) {
    const std::string caps = caps_of(format), sink = std::string("video/x-raw,format=") + output;
    const auto here = composites(caps, backend, false, sink.c_str());
    const auto there = composites(caps, backend, true, sink.c_str());
    for (std::size_t i = 0; i < 3; ++i)
      fail_unless(largest_difference(here[i], there[i]) <= 1, "%s by %s to %s, frame %d", format,
                  backend, output, static_cast<int>(i));
  }
}

ELEMENT_TEST(what_is_sent_again_is_converted_once) {
  const std::string caps = caps_of("I420");
  Passing bench;
  gst_harness_set_src_caps_str(bench.background, caps.c_str());
  GstBuffer* still = noise(caps);
  const Pixels wanted = bytes_taken(by_videoconvert(caps, gst_buffer_copy_deep(still)));
  GstMemory* memory = nullptr;
  for (int i = 0; i < 3; ++i) {
    GstBuffer* again = gst_buffer_copy(still);  // the same memory
    GST_BUFFER_PTS(again) = frame_time(i);
    GstBuffer* out = bench.pass(again);
    fail_unless_equals_uint64(GST_BUFFER_PTS(out), frame_time(i));
    fail_if(gst_buffer_is_all_memory_writable(out), "frame %d is anybody's", i);
    if (i == 0) memory = gst_buffer_get_memory(out, 0);
    fail_unless(gst_buffer_peek_memory(out, 0) == memory, "frame %d is elsewhere", i);
    fail_unless(bytes_taken(out) == wanted);
  }
  gst_memory_unref(memory);
  fail_unless_equals_uint64(bench.converted(), 1);
  // An owner of the memory alone may write into it; one that shares it gets another one.
  still = gst_buffer_make_writable(still);
  GstMapInfo map;
  fail_unless(gst_buffer_map(still, &map, GST_MAP_WRITE));
  map.data[0] = static_cast<std::uint8_t>(map.data[0] ^ 0x40);
  gst_buffer_unmap(still, &map);
  const Pixels other = bytes_taken(by_videoconvert(caps, gst_buffer_copy_deep(still)));
  fail_unless(bytes_taken(bench.pass(still)) == other);
  fail_unless_equals_uint64(bench.converted(), 2);
}

ELEMENT_TEST(nothing_is_held_after_the_stop) {
  const std::string caps = caps_of("NV12");
  Passing bench;
  gst_harness_set_src_caps_str(bench.background, caps.c_str());
  GstBuffer* still = noise(caps);
  gst_buffer_unref(bench.pass(gst_buffer_copy(still)));
  GstMemory* memory = gst_buffer_peek_memory(still, 0);
  gst_element_set_state(bench.element, GST_STATE_NULL);
  fail_unless_equals_int(GST_MINI_OBJECT_REFCOUNT_VALUE(memory), 1);
  gst_buffer_unref(still);
}

ELEMENT_TEST(what_is_sent_again_is_uploaded_once) {
  const std::string caps = caps_of("NV12");
  Bench bench;
  bench.wait_for_all();
  gst_util_set_object_arg(G_OBJECT(bench.element), "backend", "gl");
  gst_harness_set_src_caps_str(bench.background, caps.c_str());
  gst_harness_push(bench.mesh, mesh_buffer(0));
  GstBuffer* still = noise(caps);
  Pixels first;
  guint64 once = 0;
  for (int i = 0; i < 3; ++i) {
    GstBuffer* again = gst_buffer_copy(still);
    GST_BUFFER_PTS(again) = frame_time(i);
    const Pixels drawn = bytes_taken(bench.step(again, mesh_buffer(frame_time(i + 1))));
    if (i == 0) first = drawn, once = statistic(bench.element, "background-bytes-uploaded");
    fail_unless(drawn == first, "frame %d is another", i);
  }
  fail_unless(once > 0);
  fail_unless_equals_uint64(statistic(bench.element, "background-bytes-uploaded"), once);
  fail_unless_equals_uint64(statistic(bench.element, "backgrounds-converted"), 1);
  gst_buffer_unref(still);
}

// Rows and planes apart as decoders have them, and what else is in the memory told from it.
ELEMENT_TEST(planes_lie_anywhere) {
  const std::string caps = caps_of("NV12", 33, 17);
  GstBuffer* tight = noise(caps);
  GstBuffer* wide = gst_buffer_new_allocate(nullptr, 10000, nullptr);
  gst_buffer_memset(wide, 0, 77, 10000);
  gsize offsets[4] = {0, 4000, 0, 0};
  gint strides[4] = {96, 112, 0, 0};
  gst_buffer_add_video_meta_full(wide, GST_VIDEO_FRAME_FLAG_NONE, GST_VIDEO_FORMAT_NV12, 33, 17, 2,
                                 offsets, strides);
  const GstVideoInfo info = info_of(caps);
  GstVideoFrame from, to;
  fail_unless(gst_video_frame_map(&from, &info, tight, GST_MAP_READ));
  fail_unless(gst_video_frame_map(&to, &info, wide, GST_MAP_WRITE));
  gst_video_frame_copy(&to, &from);
  gst_video_frame_unmap(&to);
  gst_video_frame_unmap(&from);
  const Pixels wanted = bytes_taken(by_videoconvert(caps, tight));
  Passing bench;
  gst_harness_set_src_caps_str(bench.background, caps.c_str());
  fail_unless(bytes_taken(bench.pass(gst_buffer_ref(wide))) == wanted);
  GstBuffer* shifted = gst_buffer_copy(wide);
  gst_buffer_get_video_meta(shifted)->offset[1] = 0;
  gst_buffer_unref(wide);
  fail_unless(bytes_taken(bench.pass(shifted)) != wanted, "another plane is the same picture");
}

ELEMENT_TEST(a_buffer_that_is_too_small) {
  const std::string caps = caps_of("I420");
  Passing bench;
  GstBus* bus = gst_bus_new();
  gst_element_set_bus(bench.element, bus);
  gst_harness_set_src_caps_str(bench.background, caps.c_str());
  gst_harness_push(bench.background, gst_buffer_new_allocate(nullptr, 1000, nullptr));
  GstMessage* message = gst_bus_timed_pop_filtered(bus, 20 * GST_SECOND, GST_MESSAGE_ERROR);
  fail_unless(message != nullptr);
  GError* error = nullptr;
  gst_message_parse_error(message, &error, nullptr);
  fail_unless(std::string(error->message).find("1000 bytes") != std::string::npos, "%s",
              error->message);
  g_clear_error(&error);
  gst_message_unref(message);
  gst_element_set_bus(bench.element, nullptr);
  gst_object_unref(bus);
}

// Pixels twice as wide as high show the same subject in half as many of them; a pixel's width along its
// outline may differ.
ELEMENT_TEST(pixels_that_are_not_square) {
  const auto changed = [](const char* shape) {
    Bench bench;
    bench.wait_for_all();
    gst_util_set_object_arg(G_OBJECT(bench.element), "shadow", "off");
    gst_util_set_object_arg(G_OBJECT(bench.element), "mirror", "off");
    const std::string caps = background_caps + std::string(",pixel-aspect-ratio=") + shape;
    gst_harness_set_src_caps_str(bench.background, caps.c_str());
    gst_harness_push(bench.mesh, mesh_buffer(0));
    g_autoptr(GstBuffer) out = bench.step(opaque_frame(0), mesh_buffer(frame_time(1)));
    return changed_pixels(out);
  };
  const int square = changed("1/1"), wide = changed("2/1");
  fail_unless(square > 1000, "%d", square);
  fail_unless(std::abs(2 * wide - square) < 4 * height, "%d and %d", square, wide);
}

ELEMENT_TEST(colours_that_nothing_converts_are_said) {
  for (const auto& [colours, said] : {std::pair{"bt709", 0u},
                                      {"bt601", 0u},
                                      {"bt2100-hlg", 1u},
                                      {"bt2100-pq", 1u},
                                      {"bt2020", 1u}})
    for (const char* element : {"composite", "chromamatte", "silhouette"}) {
      Played line("videotestsrc num-buffers=1 ! " + caps_of("I420") +
                  " ! capssetter caps=video/x-raw,colorimetry=" + colours + " ! " + element +
                  " name=e ! fakesink");
      check_ended(line.run());
      g_autoptr(GstElement) found = gst_bin_get_by_name(GST_BIN(line.pipeline), "e");
      fail_unless_equals_uint64(statistic(found, "colours-unconverted"), said);
    }
}

ELEMENT_TEST(straight_from_decodebin) {
  const Folder folder;
  check_ended(
      run_to_end("videotestsrc num-buffers=5 ! video/x-raw,width=321,height=181,"
                 "framerate=25/1,format=Y444 ! x264enc ! matroskamux ! filesink location=" +
                 folder.file("film.mkv")));
  check_ended(
      run_to_end("videotestsrc num-buffers=5 ! video/x-raw,width=320,height=180,"
                 "framerate=25/1,format=I420 ! x264enc ! mp4mux ! filesink location=" +
                 folder.file("film.mp4")));
  for (const char* name : {"film.mkv", "film.mp4"}) {
    const std::string source = "filesrc location=" + folder.file(name) + " ! decodebin ! ";
    Played here(source + "mix.background composite name=mix ! fakesink name=out");
    check_ended(here.run());
    Played there(source + "videoconvert ! video/x-raw,format=RGBA ! fakesink name=out");
    check_ended(there.run());
    fail_unless_equals_uint64(here.of("out").size(), 5);
    fail_unless(here.of("out") == there.of("out"), "%s", name);
  }
}
