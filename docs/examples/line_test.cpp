// SPDX-License-Identifier: LGPL-2.1-or-later
// A gst-check test of a line with polyhull (docs/testing.md): four cameras' files go in, the meshes that come
// out are of whole instants, nothing was complained of, and no frame was lost.
//   g++ -std=c++20 line_test.cpp $(pkg-config --cflags --libs polyhull gstreamer-check-1.0 gstreamer-app-1.0) -o line_test
#include <gst/app/gstappsink.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "builtin/stamp.h"
#include "wire/mesh_payload.h"
// Defines the macro fail, so last.
#include <gst/check/gstcheck.h>

namespace {

constexpr int frames = 3;
std::string folder;

/// Plays a line to its end and returns it; each warning or error is a failure.
GstElement* play(const std::string& line) {
  GError* error = nullptr;
  GstElement* pipeline = gst_parse_launch(line.c_str(), &error);
  fail_unless(error == nullptr, "%s", error ? error->message : "");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GstBus* bus = gst_element_get_bus(pipeline);
  GstMessage* message = gst_bus_timed_pop_filtered(
      bus, 60 * GST_SECOND,
      static_cast<GstMessageType>(GST_MESSAGE_EOS | GST_MESSAGE_ERROR | GST_MESSAGE_WARNING));
  fail_unless(message != nullptr, "the line did not end");
  fail_unless(GST_MESSAGE_TYPE(message) == GST_MESSAGE_EOS, "%s from %s",
              GST_MESSAGE_TYPE_NAME(message), GST_MESSAGE_SRC_NAME(message));
  gst_message_unref(message);
  gst_object_unref(bus);
  return pipeline;
}

void stop(GstElement* pipeline) {
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
}

std::string file_of(int camera) {
  return folder + "/cam" + std::to_string(camera) + ".y4m";
}

/// Stands for the recordings: numbered frames of the synthetic figure.
void record() {
  folder = g_dir_make_tmp("line-test-XXXXXX", nullptr);
  for (int camera = 0; camera < 4; ++camera)
    stop(play("rigtestsrc stamp=true camera=cam" + std::to_string(camera) +
              " num-buffers=" + std::to_string(frames) +
              " ! videoconvert ! video/x-raw,format=Y444 ! y4menc ! filesink location=" +
              file_of(camera)));
}

void remove_recordings() {
  std::filesystem::remove_all(folder);
}

/// The frame number that a camera's view shows.
std::optional<std::uint16_t> number_of(const polyhull::View& view) {
  return polyhull::read_stamp(view.pixels.data(), view.stride, view.roi.width, view.roi.height);
}

guint64 count(GstElement* pipeline, const char* element, const char* counter) {
  GstElement* found = gst_bin_get_by_name(GST_BIN(pipeline), element);
  GstStructure* stats = nullptr;
  g_object_get(found, "stats", &stats, nullptr);
  guint64 value = 0;
  fail_unless(gst_structure_get_uint64(stats, counter, &value), "no counter %s", counter);
  gst_structure_free(stats);
  gst_object_unref(found);
  return value;
}

}  // namespace

GST_START_TEST(meshes_are_of_whole_instants) {
  std::string line = "hullbuild name=hull ! appsink name=out sync=false wait-on-eos=false ";
  for (int camera = 0; camera < 4; ++camera)
    line += "filesrc location=" + file_of(camera) + " ! y4mdec ! silhouette camera=cam" +
            std::to_string(camera) + " ! hull. ";
  GstElement* pipeline = play(line);
  GstElement* out = gst_bin_get_by_name(GST_BIN(pipeline), "out");
  for (int frame = 0; frame < frames; ++frame) {
    GstSample* sample = gst_app_sink_pull_sample(GST_APP_SINK(out));
    fail_unless(sample != nullptr);
    GstBuffer* buffer = gst_sample_get_buffer(sample);
    std::vector<std::uint8_t> bytes(gst_buffer_get_size(buffer));
    gst_buffer_extract(buffer, 0, bytes.data(), bytes.size());
    const polyhull::Mesh mesh = polyhull::read_mesh(bytes);
    fail_unless_equals_int(mesh.views.size(), 4);
    int readable = 0;
    for (const polyhull::MeshView& seen : mesh.views) {
      const auto number = number_of(seen.view);
      if (!number) continue;  // the label is turned away from this camera
      ++readable;
      fail_unless_equals_int(*number, frame);
    }
    fail_unless(readable > 0);
    gst_sample_unref(sample);
  }
  fail_unless_equals_uint64(count(pipeline, "hull", "sets"), frames);
  fail_unless_equals_uint64(count(pipeline, "hull", "sets-incomplete"), 0);
  gst_object_unref(out);
  stop(pipeline);
}
GST_END_TEST

int main(int argc, char** argv) {
  gst_check_init(&argc, &argv);
  Suite* suite = suite_create("a line with polyhull");
  TCase* recorded = tcase_create("recorded");
  tcase_set_timeout(recorded, 120);
  // In the process of each test: an unchecked fixture's threads would be missing there.
  tcase_add_checked_fixture(recorded, record, remove_recordings);
  tcase_add_test(recorded, meshes_are_of_whole_instants);
  suite_add_tcase(suite, recorded);
  return gst_check_run_suite(suite, "line_test", __FILE__);
}
