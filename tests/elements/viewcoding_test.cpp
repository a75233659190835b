// SPDX-License-Identifier: LGPL-2.1-or-later
// viewencode and viewdecode: what comes out is what went in, whatever lies between.
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "wire/view_payload.h"

#include <gst/check/gstharness.h>

#include "element_checks.h"
#include "support/folder.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

constexpr char view_caps[] = "application/x-polyhull-view";

std::string bytes_of(GstBuffer* buffer) {
  GstMapInfo map;
  gst_buffer_map(buffer, &map, GST_MAP_READ);
  std::string bytes(reinterpret_cast<char*>(map.data), map.size);
  gst_buffer_unmap(buffer, &map);
  return bytes;
}

/// What a line's fakesink `out` gets.
std::vector<std::string> outputs(const std::string& line) {
  GstElement* pipeline = parse(line);
  GstElement* sink = named(pipeline, "out");
  g_object_set(sink, "signal-handoffs", TRUE, nullptr);
  std::vector<std::string> seen;
  g_signal_connect(
      sink, "handoff",
      G_CALLBACK(+[](GstElement*, GstBuffer* buffer, GstPad*, std::vector<std::string>* all) {
        all->push_back(bytes_of(buffer));
      }),
      &seen);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  check_ended(wait_for_end(pipeline));
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
  return seen;
}

/// Five instants of three cameras, recorded: their capture times are the same each time.
struct Take {
  Take() {
    std::string line = "takesink name=t location=" + folder.path + "/views.take ";
    for (const char* number : {"0", "1", "2"})
      line += std::string("rigtestsrc camera=cam") + number +
              " num-buffers=5 ! video/x-raw,framerate=25/1 ! silhouette camera=cam" + number +
              " ! t.sink_" + number + " ";
    check_ended(run_to_end(line));
  }

  std::string hulls(const std::string& between) const {
    std::string line = "takesrc name=t location=" + folder.path +
                       "/views.take hullbuild name=h ! hulltexture ! fakesink name=out ";
    for (const char* number : {"0", "1", "2"})
      line += std::string("t.src_") + number + " ! " + between + " queue ! h. ";
    return line;
  }

  Folder folder;
};

constexpr char camera[] = "rigtestsrc camera=cam0 num-buffers=6 ! silhouette camera=cam0 ! ";

}  // namespace

ELEMENT_TEST(test_documented) {
  check_documented("viewencode");
  check_documented("viewdecode");
}

ELEMENT_TEST(test_hulls_and_colours_are_the_same) {
  const Take take;
  const auto plain = outputs(take.hulls(""));
  fail_unless_equals_int(plain.size(), 5);
  for (const char* coding : {"none", "lz4", "zstd", "auto link=50", "auto link=100000"}) {
    const auto packed = outputs(take.hulls(std::string("viewencode coding=") + coding +
                                           " ! gdppay ! gdpdepay ! viewdecode !"));
    fail_unless_equals_int(packed.size(), 5);
    // Rows lie without gaps behind viewdecode; the rig test's do before, too.
    for (std::size_t i = 0; i < plain.size(); ++i)
      fail_unless(plain[i] == packed[i], "%s: hull %zu", coding, i);
  }
}

ELEMENT_TEST(test_packed_views_are_smaller) {
  const auto size = [](const std::string& coding) {
    std::size_t sum = 0;
    for (const std::string& view :
         outputs(camera + std::string("viewencode coding=") + coding + " ! fakesink name=out"))
      sum += view.size();
    return static_cast<double>(sum);
  };
  const double raw = size("none"), lz4 = size("lz4"), zstd = size("zstd"), jpeg = size("jpeg");
  std::printf("lz4 %.1f %%, zstd %.1f %%, jpeg %.1f %%\n", 100 * lz4 / raw, 100 * zstd / raw,
              100 * jpeg / raw);
  fail_unless(lz4 < 0.85 * raw && zstd < 0.6 * raw && jpeg < 0.3 * raw);
}

ELEMENT_TEST(test_hullbuild_says_what_is_missing) {
  const Take take;
  GstElement* pipeline = parse(take.hulls("viewencode coding=zstd !"));
  GstBus* bus = gst_element_get_bus(pipeline);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GstMessage* message = gst_bus_timed_pop_filtered(bus, 30 * GST_SECOND, GST_MESSAGE_WARNING);
  fail_unless(message != nullptr);
  GError* said = nullptr;
  gst_message_parse_warning(message, &said, nullptr);
  fail_unless(strstr(said->message, "viewdecode") != nullptr, "%s", said->message);
  g_error_free(said);
  gst_message_unref(message);
  gst_object_unref(bus);
  stop(pipeline);
}

ELEMENT_TEST(test_coding_changes_while_it_plays) {
  GstHarness* harness = gst_harness_new_parse("viewencode name=e coding=none ! viewdecode name=d");
  gst_harness_set_src_caps_str(harness, view_caps);
  GstElement* encoder = gst_harness_find_element(harness, "viewencode");
  GstElement* decoder = gst_harness_find_element(harness, "viewdecode");
  std::vector<std::uint8_t> pixels(64 * 48 * 4);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint8_t>(i / 7);
  View view;
  view.camera = "cam0";
  view.width = 64;
  view.height = 48;
  view.roi = {0, 0, 64, 48};
  view.format = PixelFormat::rgba;
  view.stride = 256;
  view.pixels = pixels;
  const auto payload = write_view(view);
  for (const char* coding : {"none", "lz4", "zstd", "none", "auto", "zstd"}) {
    gst_util_set_object_arg(G_OBJECT(encoder), "coding", coding);
    GstBuffer* buffer = gst_buffer_new_memdup(payload.data(), payload.size());
    GST_BUFFER_PTS(buffer) = 40 * GST_MSECOND;
    GST_BUFFER_DURATION(buffer) = 20 * GST_MSECOND;
    fail_unless_equals_int(gst_harness_push(harness, buffer), GST_FLOW_OK);
    GstBuffer* out = gst_harness_pull(harness);
    fail_unless(bytes_of(out) == std::string(payload.begin(), payload.end()), "%s", coding);
    fail_unless_equals_uint64(GST_BUFFER_PTS(out), 40 * GST_MSECOND);
    fail_unless_equals_uint64(GST_BUFFER_DURATION(out), 20 * GST_MSECOND);
    gst_buffer_unref(out);
  }
  fail_unless_equals_uint64(statistic(encoder, "views"), 6);
  fail_unless(statistic(encoder, "views-zstd") >= 2);
  fail_unless_equals_uint64(statistic(encoder, "views-lz4") + statistic(encoder, "views-zstd") +
                                statistic(encoder, "views-raw"),
                            6);
  fail_unless_equals_uint64(statistic(decoder, "views"), 6);
  // A view without pixels stays as it is.
  view.roi = {};
  view.format = PixelFormat::none;
  view.stride = 0;
  view.pixels = {};
  const auto bare = write_view(view);
  fail_unless_equals_int(gst_harness_push(harness, gst_buffer_new_memdup(bare.data(), bare.size())),
                         GST_FLOW_OK);
  GstBuffer* out = gst_harness_pull(harness);
  fail_unless(bytes_of(out) == std::string(bare.begin(), bare.end()));
  gst_buffer_unref(out);
  gst_object_unref(encoder);
  gst_object_unref(decoder);
  gst_harness_teardown(harness);
}

ELEMENT_TEST(test_bad_input) {
  for (const char* element : {"viewencode", "viewdecode"}) {
    GstHarness* harness = gst_harness_new(element);
    gst_harness_set_src_caps_str(harness, view_caps);
    for (const std::string& bytes : {std::string(), std::string("PHVW"), std::string(1000, 'x')}) {
      GstBuffer* buffer =
          bytes.empty() ? gst_buffer_new() : gst_buffer_new_memdup(bytes.data(), bytes.size());
      fail_unless_equals_int(gst_harness_push(harness, buffer), GST_FLOW_OK);
      fail_unless(gst_harness_try_pull(harness) == nullptr);
    }
    const bool packs = std::string(element) == "viewencode";
    fail_unless_equals_uint64(
        statistic(harness->element, packs ? "views-unusable" : "views-damaged"), 3);
    gst_harness_teardown(harness);
  }
}

ELEMENT_TEST(test_states) {
  check_states(std::string("rigtestsrc camera=cam0 ! silhouette camera=cam0 ! viewencode ! "
                           "viewdecode ! fakesink"),
               20);
}
