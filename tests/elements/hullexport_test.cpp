// SPDX-License-Identifier: LGPL-2.1-or-later
#include <gst/check/gstharness.h>

#include <cstring>
#include <sstream>

#include "base/error.h"
#include "box_views.h"
#include "builtin/default_rig.h"
#include "element_checks.h"
#include "hull/measure.h"
#include "support/folder.h"
#include "support/obj_reader.h"
#include "wire/mesh_payload.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

constexpr int frames = 5;

std::string folder(const std::string& name) {
  static const Folder all;
  std::filesystem::create_directories(all.file(name));
  return all.file(name);
}

std::string views() {
  static const std::string files = write_view_files(folder("views"), frames);
  return files;
}

std::string export_line(const std::string& properties) {
  return "hullbuild name=hull ! hullexport name=export " + properties + " " +
         all_view_files(views());
}

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream out;
  out << file.rdbuf();
  return out.str();
}

// The middle of an OBJ file's hull along x: the box moves by 1 cm from frame to frame.
double middle_of(const std::string& path) {
  const ObjModel model = read_obj(path);
  float low = 1e9f, high = -1e9f;
  for (const Vec3f& p : model.positions) {
    low = std::min(low, p.x);
    high = std::max(high, p.x);
  }
  return (low + high) / 2;
}

std::string refusal(const std::string& line) {
  GstElement* pipeline = parse(line);
  std::string message = "it was not refused";
  if (gst_element_set_state(pipeline, GST_STATE_PAUSED) == GST_STATE_CHANGE_FAILURE)
    message = wait_for_end(pipeline, GST_SECOND);
  stop(pipeline);
  return message;
}

}  // namespace

ELEMENT_TEST(test_documented) {
  check_documented("hullexport");
}

ELEMENT_TEST(test_numbered_sequence) {
  const std::string out = folder("sequence");
  check_ended(run_to_end(export_line("location=" + out + "/hull-%05d.obj")));
  for (int i = 1; i < frames; ++i) {
    const auto name = [&](int k) { return out + "/hull-0000" + std::to_string(k) + ".obj"; };
    const double moved = middle_of(name(i)) - middle_of(name(i - 1));
    fail_unless(moved > 0.003 && moved < 0.03, "moved by %g", moved);
  }
  fail_unless(!std::filesystem::exists(out + "/hull-00005.obj"));
  check_ended(run_to_end(export_line("every=2 location=" + out + "/e%d.ply")));
  fail_unless(std::filesystem::exists(out + "/e2.ply") &&
              !std::filesystem::exists(out + "/e3.ply"));
  // Nothing half written is left.
  for (const auto& entry : std::filesystem::directory_iterator(out))
    fail_unless(entry.path().string().find(".part") == std::string::npos);
}

ELEMENT_TEST(test_nothing_to_write_is_told) {
  const std::string out = folder("nothing");
  GstElement* pipeline =
      parse("fakesrc num-buffers=0 ! application/x-polyhull-mesh ! hullexport location=" + out +
            "/hull.glb");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GstBus* bus = gst_element_get_bus(pipeline);
  GstMessage* message = gst_bus_timed_pop_filtered(
      bus, 20 * GST_SECOND, static_cast<GstMessageType>(GST_MESSAGE_WARNING | GST_MESSAGE_ERROR));
  fail_unless(message != nullptr && GST_MESSAGE_TYPE(message) == GST_MESSAGE_WARNING);
  gst_message_unref(message);
  check_ended(wait_for_end(pipeline));
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(bus);
  gst_object_unref(pipeline);
  fail_unless(!std::filesystem::exists(out + "/hull.glb"));
}

// A refusal is one error, and only empty meshes for keep=first are told of.
ELEMENT_TEST(test_one_message_each) {
  const auto count = [](const std::string& line, GstMessageType type) {
    GstElement* pipeline = parse(line);
    GstBus* bus = gst_element_get_bus(pipeline);
    if (gst_element_set_state(pipeline, GST_STATE_PLAYING) != GST_STATE_CHANGE_FAILURE) {
      gst_message_unref(gst_bus_timed_pop_filtered(bus, 20 * GST_SECOND, GST_MESSAGE_ASYNC_DONE));
      g_usleep(200000);
    }
    int found = 0;
    while (GstMessage* message = gst_bus_pop_filtered(bus, type)) {
      ++found;
      gst_message_unref(message);
    }
    gst_element_set_state(pipeline, GST_STATE_NULL);
    gst_object_unref(bus);
    gst_object_unref(pipeline);
    return found;
  };
  fail_unless_equals_int(count("fakesrc ! hullexport", GST_MESSAGE_ERROR), 1);
  const std::string out = folder("empty");
  const std::vector<std::uint8_t> bytes = write_mesh(Mesh());
  std::ofstream(out + "/0.mesh", std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  const std::string line = "multifilesrc stop-index=0 location=" + out +
                           "/%d.mesh caps=application/x-polyhull-mesh ! hullexport location=" + out;
  fail_unless_equals_int(count(line + "/first.glb keep=first", GST_MESSAGE_WARNING), 1);
  fail_unless(!std::filesystem::exists(out + "/first.glb"));
  fail_unless_equals_int(count(line + "/last.glb", GST_MESSAGE_WARNING), 0);
  fail_unless(std::filesystem::exists(out + "/last.glb"));
}

// Meshes of a subject that fades are the last whole one over again.
ELEMENT_TEST(test_fading_meshes_are_left_out) {
  const std::string out = folder("fading");
  GstHarness* bench = gst_harness_new_parse(("hullexport location=" + out + "/%d.ply").c_str());
  gst_harness_set_src_caps_str(bench, "application/x-polyhull-mesh");
  for (const float opacity : {1.0f, 0.5f, 0.0f, 0.5f, 1.0f}) {
    Mesh mesh;
    mesh.opacity = opacity;
    const std::vector<std::uint8_t> bytes = write_mesh(mesh);
    gst_harness_push(bench, gst_buffer_new_memdup(bytes.data(), bytes.size()));
  }
  fail_unless(std::filesystem::exists(out + "/1.ply") && !std::filesystem::exists(out + "/2.ply"));
  GstElement* element = gst_harness_find_element(bench, "hullexport");
  fail_unless_equals_uint64(statistic(element, "meshes-fading"), 3);
  gst_object_unref(element);
  gst_harness_teardown(bench);
}

ELEMENT_TEST(test_first_and_last) {
  const std::string out = folder("one");
  check_ended(run_to_end(export_line("location=" + out + "/last.obj")));
  check_ended(run_to_end(export_line("keep=first location=" + out + "/first.obj")));
  const double moved = middle_of(out + "/last.obj") - middle_of(out + "/first.obj");
  fail_unless(moved > 0.02 && moved < 0.08, "moved by %g", moved);
}

ELEMENT_TEST(test_last_is_written_without_end_of_stream) {
  const std::string out = folder("stopped");
  GstElement* pipeline = parse(export_line("location=" + out + "/hull.glb"));
  gst_element_set_state(pipeline, GST_STATE_PAUSED);
  gst_element_get_state(pipeline, nullptr, nullptr, 10 * GST_SECOND);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  g_usleep(200000);
  stop(pipeline);
  fail_unless(content(out + "/hull.glb").compare(0, 4, "glTF") == 0);
}

ELEMENT_TEST(test_files_are_announced) {
  const std::string out = folder("announced");
  GstElement* pipeline = parse(export_line("location=" + out + "/h%d.ply"));
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GstBus* bus = gst_element_get_bus(pipeline);
  int files = 0;
  for (;;) {
    GstMessage* message = gst_bus_timed_pop_filtered(
        bus, 10 * GST_SECOND,
        static_cast<GstMessageType>(GST_MESSAGE_ELEMENT | GST_MESSAGE_EOS | GST_MESSAGE_ERROR));
    fail_unless(message != nullptr);
    const bool end = GST_MESSAGE_TYPE(message) != GST_MESSAGE_ELEMENT;
    if (!end) {
      const GstStructure* s = gst_message_get_structure(message);
      if (gst_structure_has_name(s, "hullexport-file")) {
        const std::string location = gst_structure_get_string(s, "location");
        fail_unless(location == out + "/h" + std::to_string(files) + ".ply");
        fail_unless(std::filesystem::exists(location));
        ++files;
      }
    }
    gst_message_unref(message);
    if (end) break;
  }
  fail_unless_equals_int(files, frames);
  gst_object_unref(bus);
  stop(pipeline);
}

ELEMENT_TEST(test_refusals) {
  expect_in(refusal("fakesrc ! hullexport"), {"location="});
  expect_in(refusal("fakesrc ! hullexport location=/tmp/hull.unknown"), {"hull.unknown", ".glb"});
  expect_in(refusal("fakesrc ! hullexport location=/nowhere/hull.glb"),
            {"/nowhere/hull.glb", "No such file"});
  for (const char* name : {"%s.glb", "%d-%d.glb", "%n.glb", "%", "%5.glb", "%999d.glb", "%x.glb"})
    expect_in(refusal(std::string("fakesrc ! hullexport location=/tmp/") + name), {"%05d"});
  // Two that write one file, which only its spelling hides; one after the other they may.
  const std::string both = folder("both");
  const std::string twice = "fakesrc num-buffers=0 ! hullexport location=" + both +
                            "/h.ply fakesrc num-buffers=0 ! hullexport location=" + both;
  expect_in(refusal(twice + "/./h.ply"), {"h.ply", "already writes"});
  for (int i = 0; i < 2; ++i) check_ended(run_to_end(twice + "/h.obj"));
  // Lost while it runs: the folder vanishes.
  const std::string out = folder("vanishes");
  GstElement* pipeline = parse(export_line("location=" + out + "/%d.ply"));
  gst_element_set_state(pipeline, GST_STATE_READY);
  GstElement* element = named(pipeline, "export");
  gst_element_set_state(element, GST_STATE_PAUSED);
  std::filesystem::remove_all(out);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  expect_in(wait_for_end(pipeline, 10 * GST_SECOND), {"Cannot write", "/0.ply"});
  stop(pipeline);
}

ELEMENT_TEST(test_hostile_meshes_are_skipped) {
  const std::string out = folder("hostile");
  GstElement* element = gst_element_factory_make("hullexport", nullptr);
  g_object_set(element, "location", (out + "/%d.ply").c_str(), nullptr);
  GstHarness* harness = gst_harness_new_with_element(element, "sink", nullptr);
  gst_object_unref(element);
  gst_harness_set_src_caps_str(harness, "application/x-polyhull-mesh");
  std::vector<std::uint8_t> bytes = write_mesh(Mesh());
  fail_unless_equals_int(gst_harness_push(harness, buffer_of(bytes)), GST_FLOW_OK);
  bytes[40] = 0xFF;
  bytes[41] = 0xFF;
  fail_unless_equals_int(gst_harness_push(harness, buffer_of(bytes)), GST_FLOW_OK);
  bytes.resize(50);
  fail_unless_equals_int(gst_harness_push(harness, buffer_of(bytes)), GST_FLOW_OK);
  fail_unless_equals_int(gst_harness_push(harness, gst_buffer_new()), GST_FLOW_OK);
  fail_unless_equals_uint64(statistic(harness->element, "meshes-unusable"), 3);
  fail_unless_equals_uint64(statistic(harness->element, "files"), 1);
  fail_unless(content(out + "/0.ply").find("element face 0\n") != std::string::npos);
  gst_harness_teardown(harness);
}

ELEMENT_TEST(test_states) {
  check_states(export_line("location=" + folder("states") + "/%d.ply"));
}

// Views and meshes as bytes through gdppay and a TCP connection come out as they went in.
ELEMENT_TEST(test_over_the_network) {
  const std::string out = folder("network");
  const auto digest = [&](const std::string& name) {
    std::string all;
    for (int i = 0; i < frames; ++i) all += content(out + "/" + name + std::to_string(i));
    fail_unless(!all.empty());
    return all;
  };
  const auto sink = [&](const std::string& name) {
    return "multifilesink location=" + out + "/" + name + "%d ";
  };
  check_ended(run_to_end("hullbuild name=hull ! " + sink("direct") + all_view_files(views())));

  int port = 20000 + getpid() % 20000;
  std::string server, client = "hullbuild name=hull ! gdppay ! gdpdepay ! " + sink("network");
  for (const Camera& camera : default_rig().cameras) {
    const std::string at = " host=127.0.0.1 port=" + std::to_string(++port) + " ";
    server += view_files(views(), camera.name) + "! gdppay ! tcpserversink sync=false" + at;
    client += "tcpclientsrc " + at + "! gdpdepay ! queue ! hull. ";
  }
  // The server has to listen before clients come, and keeps what it has for them.
  GstElement* server_pipeline = parse(server);
  gst_element_set_state(server_pipeline, GST_STATE_PAUSED);
  gst_element_get_state(server_pipeline, nullptr, nullptr, GST_SECOND);
  GstElement* client_pipeline = parse(client);
  gst_element_set_state(client_pipeline, GST_STATE_PLAYING);
  g_usleep(500000);
  gst_element_set_state(server_pipeline, GST_STATE_PLAYING);
  g_usleep(1000000);
  gst_element_set_state(server_pipeline, GST_STATE_NULL);
  check_ended(wait_for_end(client_pipeline, 20 * GST_SECOND));
  stop(client_pipeline);
  gst_object_unref(server_pipeline);
  fail_unless(digest("direct") == digest("network"));
}
