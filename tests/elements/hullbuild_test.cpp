// SPDX-License-Identifier: LGPL-2.1-or-later
#include <gst/check/gstharness.h>
#include <gst/check/gsttestclock.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <numbers>

#include "base/thread_pool.h"
#include "element_test.h"
#include "hull/measure.h"
#include "hull_bench.h"
#include "rig/undistort.h"

using namespace polyhull;
using namespace polyhull::test;

ELEMENT_TEST(test_documented) {
  check_documented("hullbuild");
}

ELEMENT_TEST(test_a_box_becomes_its_hull) {
  Bench bench;
  const Box box;
  for (int i = 0; i < 4; ++i) bench.push_box(i, 0, box);
  const auto mesh = bench.pull();
  fail_unless(is_closed(mesh->hull));
  const double volume = enclosed_volume(mesh->hull);
  fail_unless(volume > box.volume() * 0.999 && volume < box.volume() * 2.0, "volume %g", volume);
  fail_unless_equals_uint64(mesh->trigger, 0);
  fail_unless_equals_int(mesh->views.size(), 4);
  // Each vertex lies on or inside each silhouette: the hull reprojects into them.
  for (int i = 0; i < 4; ++i) {
    fail_unless(mesh->views[i].calibration.name == bench.rig.cameras[i].name);
    const Rings outline = box_contours(bench.rig.cameras[i], box);
    for (const Vec3f& vertex : mesh->hull.vertices) {
      const auto p = bench.rig.cameras[i].project(mesh->hull.origin + Vec3(vertex));
      for (std::size_t j = 0; j < outline.points.size(); ++j) {
        const Vec2 a(outline.points[j]), b(outline.points[(j + 1) % outline.points.size()]);
        const double side = (b.x - a.x) * (p->y - a.y) - (b.y - a.y) * (p->x - a.x);
        fail_unless(side / glm::length(b - a) < 0.1, "a vertex leaves a silhouette");
      }
    }
  }
  // Faces name the camera and the contour edge whose plane they lie on.
  for (const HullFace& face : mesh->hull.faces) {
    if (face.view < 0) continue;
    const Camera& camera = mesh->views[face.view].calibration;
    const Rings& rings = mesh->views[face.view].view.contours;
    const Vec2 a(rings.points[face.edge]), b(rings.points[(face.edge + 1) % rings.points.size()]);
    const Vec3 normal = glm::normalize(glm::cross(camera.ray(a), camera.ray(b)));
    for (std::uint32_t k = 3 * face.first_triangle;
         k < 3 * (face.first_triangle + face.triangle_count); ++k) {
      const Vec3 X = mesh->hull.origin + Vec3(mesh->hull.vertices[mesh->hull.triangles[k]]);
      fail_unless(std::abs(glm::dot(normal, X - camera.centre())) < 1e-3);
    }
  }
  const int all = pool_threads();
  g_object_set(bench.element, "pool-threads", 2, nullptr);
  fail_unless_equals_int(pool_threads(), std::min(2, all));
  g_object_set(bench.element, "pool-threads", 0, nullptr);
  fail_unless(pool_threads() >= 1);
  fail_unless_equals_uint64(bench.count("sets"), 1);
  fail_unless_equals_uint64(bench.count("cameras"), 4);
  fail_unless(bench.count("faces") > 0);
}

ELEMENT_TEST(test_order_of_pads_and_arrival_changes_nothing) {
  std::vector<std::uint8_t> first;
  const int orders[][4] = {{0, 1, 2, 3}, {3, 1, 0, 2}, {2, 3, 1, 0}};
  for (int threads : {1, 2})
    for (const auto& order : orders) {
      Bench bench(threads == 1 ? "threads=1" : "threads=2");
      for (int i = 0; i < 4; ++i) bench.push_box(order[3 - i], 0, {}, order[order[3 - i]]);
      bench.pull();
      const double used = figure(bench.element, "threads-used");
      fail_unless(used >= 1.0 && used <= threads, "%g of %d threads", used, threads);
      if (first.empty()) first = bench.bytes;
      fail_unless(bench.bytes == first);
    }
}

ELEMENT_TEST(test_pixels_are_shared_and_outlive_the_element) {
  auto bench = std::make_unique<Bench>();
  std::vector<std::uint8_t> pixels[4];
  std::vector<gconstpointer> addresses;
  for (int i = 0; i < 4; ++i) {
    const View view = box_view(bench->rig.cameras[i], {}, 0, pixels[i]);
    GstBuffer* buffer = buffer_of(write_view_header(view));
    GstMemory* memory = gst_allocator_alloc(nullptr, view.pixels.size(), nullptr);
    GstMapInfo map;
    gst_memory_map(memory, &map, GST_MAP_WRITE);
    std::copy(view.pixels.begin(), view.pixels.end(), map.data);
    addresses.push_back(map.data);
    gst_memory_unmap(memory, &map);
    gst_buffer_append_memory(buffer, memory);
    GST_BUFFER_PTS(buffer) = 0;
    gst_harness_push(bench->inputs[i], buffer);
  }
  GstBuffer* mesh = gst_harness_pull(bench->output);
  fail_unless_equals_int(gst_buffer_n_memory(mesh), 5);
  bench.reset();
  for (int i = 0; i < 4; ++i) {
    GstMapInfo map;
    gst_memory_map(gst_buffer_peek_memory(mesh, i + 1), &map, GST_MAP_READ);
    fail_unless(map.data == addresses[i]);
    fail_unless(std::equal(pixels[i].begin(), pixels[i].end(), map.data));
    gst_memory_unmap(gst_buffer_peek_memory(mesh, i + 1), &map);
  }
  gst_buffer_unref(mesh);
}

ELEMENT_TEST(test_odd_silhouettes_cost_their_set_only) {
  Rig wide = default_rig();
  for (Camera& camera : wide.cameras) camera.K[0][0] = camera.K[1][1] = 1.0;
  const std::string path = folder.file("wide") + ".json";
  std::ofstream(path) << rig_to_json(wide);
  Bench bench("rig=" + path, 2);
  bench.rig = wide;
  std::vector<std::uint8_t> pixels;
  View odd = box_view(wide.cameras[0], {}, 0, pixels);
  odd.contours.points[0].x = 9e5f;
  bench.push(0, odd, 0);
  bench.push_box(1, 0);
  for (int i = 0; i < 2; ++i) bench.push_box(i, 1);
  fail_unless_equals_uint64(bench.pull()->trigger, 1);
  fail_unless_equals_uint64(bench.count("sets-refused"), 1);
  fail_unless(bench.messages(GST_MESSAGE_WARNING) >= 1);
}

ELEMENT_TEST(test_latency_is_reported) {
  Bench bench("max-wait=70000000", 2, true);
  for (GstHarness* input : bench.inputs) gst_harness_set_upstream_latency(input, 10 * GST_MSECOND);
  bench.push_box(0, 0);
  bench.push_box(1, 0);
  bench.pull();
  const GstClockTime latency = gst_harness_query_latency(bench.output);
  fail_unless(latency >= 80 * GST_MSECOND && latency < 2 * GST_SECOND, "%" GST_TIME_FORMAT,
              GST_TIME_ARGS(latency));
  bench.messages(GST_MESSAGE_LATENCY);
  g_object_set(bench.element, "max-wait", 90 * GST_MSECOND, nullptr);
  fail_unless(bench.messages(GST_MESSAGE_LATENCY) >= 1);
  fail_unless(gst_harness_query_latency(bench.output) >= latency + 19 * GST_MSECOND);
}

ELEMENT_TEST(test_bad_cameras_are_named) {
  {
    Bench bench("", 2);
    bench.push_box(0, 0);
    bench.push_box(1, 0, {}, 0);
    expect_in(bench.error(), {"sink_1", "sink_0", "cam0", "Each pad takes another camera"});
  }
  {
    Bench bench("", 2);
    std::vector<std::uint8_t> pixels;
    View view = box_view(bench.rig.cameras[0], {}, 0, pixels);
    view.camera = "";
    bench.push(0, view, 0);
    bench.push_box(1, 0);
    expect_in(bench.error(), {"sink_0", "no camera"});
  }
  {
    Bench bench("", 2);
    gst_child_proxy_set(GST_CHILD_PROXY(bench.element), "sink_0::camera", "left wing", nullptr);
    bench.push_box(0, 0);
    bench.push_box(1, 0);
    expect_in(bench.error(), {"sink_0", "left wing", "cam0, cam1, cam2, cam3"});
  }
  {
    Bench bench("", 2);
    Camera camera = bench.rig.cameras[0];
    camera.width = 640;
    camera.height = 480;
    std::vector<std::uint8_t> pixels;
    bench.push(0, box_view(camera, {}, 0, pixels), 0);
    bench.push_box(1, 0);
    expect_in(bench.error(), {"sink_0", "cam0", "640x480", "1024x768"});
  }
  {
    // The pad's property wins over the views' own name.
    Bench bench("", 2);
    gst_child_proxy_set(GST_CHILD_PROXY(bench.element), "sink_0::camera", "cam2", nullptr);
    bench.push_box(0, 0, {}, 0);
    bench.push_box(1, 0);
    const auto mesh = bench.pull();
    fail_unless(mesh->views[0].view.camera == "cam1" && mesh->views[1].view.camera == "cam2");
  }
}

ELEMENT_TEST(test_bad_rigs_are_named) {
  const std::string bad = folder.file("rig.json");
  std::ofstream(bad) << "{ oops";
  for (const auto& [rig, part] :
       {std::pair<std::string, const char*>{"/nowhere/rig.json", "rig.json"},
        {bad, "line 1, column"}}) {
    GstElement* pipeline = parse("hullbuild rig=" + rig + " ! fakesink");
    fail_unless_equals_int(gst_element_set_state(pipeline, GST_STATE_PAUSED),
                           GST_STATE_CHANGE_FAILURE);
    const std::string message = wait_for_end(pipeline, GST_SECOND);
    expect_in(message, {part});
    stop(pipeline);
  }
}

ELEMENT_TEST(test_hostile_views_are_dropped) {
  Bench bench("missing-camera=drop-camera", 3);
  std::vector<std::uint8_t> pixels;
  std::vector<std::uint8_t> bytes = write_view(box_view(bench.rig.cameras[0], {}, 0, pixels));
  bytes.resize(bytes.size() / 2);
  GstBuffer* buffer = buffer_of(bytes);
  GST_BUFFER_PTS(buffer) = 0;
  gst_harness_push(bench.inputs[0], buffer);
  for (int i = 1; i < 3; ++i) bench.push_box(i, 0);
  for (std::size_t i = 32; i < bytes.size(); ++i) bytes[i] = 0xFF;
  gst_harness_push(bench.inputs[0], buffer_of(bytes));
  gst_harness_push(bench.inputs[0], gst_buffer_new());
  bench.push_box(0, 0);
  fail_unless_equals_int(bench.pull()->views.size(), 3);
  fail_unless_equals_uint64(bench.count("views-unusable"), 3);
  fail_unless(bench.messages(GST_MESSAGE_WARNING) >= 1);
}

ELEMENT_TEST(test_empty_full_and_lone_silhouettes) {
  Bench bench;
  std::vector<std::uint8_t> pixels;
  const auto push_contours = [&](int input, int frame, const Rings& rings) {
    View view = box_view(bench.rig.cameras[input], {}, frame, pixels);
    view.contours = rings;
    bench.push(input, view, frame * frame_time);
  };
  // Nobody there; one camera alone; two with foreground and two without.
  for (int i = 0; i < 4; ++i) push_contours(i, 0, {});
  fail_unless(bench.pull()->hull.empty());
  fail_unless_equals_int(bench.messages(GST_MESSAGE_WARNING), 0);
  for (int i = 0; i < 4; ++i)
    push_contours(i, 1, i == 2 ? box_contours(bench.rig.cameras[2], {}) : Rings{});
  fail_unless(bench.pull()->hull.empty());
  fail_unless_equals_uint64(bench.count("lone-silhouettes"), 1);
  fail_unless_equals_int(bench.messages(GST_MESSAGE_WARNING), 1);
  for (int i = 0; i < 4; ++i)
    push_contours(i, 2, i < 2 ? box_contours(bench.rig.cameras[i], {}) : Rings{});
  fail_unless(bench.pull()->hull.empty());
  fail_unless_equals_uint64(bench.count("empty-meshes"), 3);
  fail_unless_equals_uint64(bench.count("triangles"), 0);
  // All foreground: what all cameras see, within the bounds.
  Rings full;
  full.points = {{-0.5f, -0.5f}, {-0.5f, 767.5f}, {1023.5f, 767.5f}, {1023.5f, -0.5f}};
  full.ends = {4};
  for (int i = 0; i < 4; ++i) push_contours(i, 3, full);
  const auto mesh = bench.pull();
  fail_unless(is_closed(mesh->hull) && !mesh->hull.empty());
  const double volume = enclosed_volume(mesh->hull);
  fail_unless(volume > 1.0 && volume < 2.4 * 2.4 * 2.3, "volume %g", volume);
  fail_unless_equals_uint64(bench.count("full-silhouettes"), 4);
  // A camera inside the subject sees only foreground.
  for (int i = 0; i < 4; ++i)
    push_contours(i, 4, i == 0 ? full : box_contours(bench.rig.cameras[i], {}));
  fail_unless(is_closed(bench.pull()->hull));
  fail_unless_equals_uint64(bench.count("full-silhouettes"), 5);
  fail_unless(bench.messages(GST_MESSAGE_WARNING) >= 1);
}

ELEMENT_TEST(test_flush_starts_anew) {
  Bench bench;
  for (int i = 0; i < 4; ++i) bench.push_box(i, 7);
  bench.pull();
  bench.push_box(0, 8);  // must not come out after the flush
  for (GstHarness* input : bench.inputs) {
    gst_harness_push_event(input, gst_event_new_flush_start());
    gst_harness_push_event(input, gst_event_new_flush_stop(TRUE));
  }
  for (GstHarness* input : bench.inputs) {
    GstSegment segment;
    gst_segment_init(&segment, GST_FORMAT_TIME);
    gst_harness_push_event(input, gst_event_new_segment(&segment));
  }
  for (int i = 0; i < 4; ++i) bench.push_box(i, 2);
  const auto mesh = bench.pull();
  fail_unless_equals_uint64(mesh->trigger, 2);
  fail_unless_equals_int(mesh->views.size(), 4);
  fail_unless_equals_uint64(GST_BUFFER_PTS(bench.last.get()), 2 * frame_time);
  fail_unless_equals_uint64(bench.count("views-late"), 0);
}

// The mesh at which a paused pipeline stands.
static Mesh mesh_at(GstElement* sink, GstClockTime& time, std::vector<std::uint8_t>& bytes) {
  GstSample* sample = nullptr;
  g_object_get(sink, "last-sample", &sample, nullptr);
  fail_unless(sample != nullptr);
  GstBuffer* buffer = gst_sample_get_buffer(sample);
  time = GST_BUFFER_PTS(buffer);
  bytes.resize(gst_buffer_get_size(buffer));
  gst_buffer_extract(buffer, 0, bytes.data(), bytes.size());
  gst_sample_unref(sample);
  return read_mesh(Bytes(bytes));
}

ELEMENT_TEST(test_seek) {
  std::string line = "hullbuild name=hull ! fakesink name=sink sync=true ";
  for (const char* camera : {"cam0", "cam1"})
    line += std::string("rigtestsrc camera=") + camera +
            " ! video/x-raw,width=1024,height=768,framerate=25/1 ! chromamatte ! gaussblur ! "
            "contourfind camera=" +
            camera + " ! queue ! hull. ";
  GstElement* pipeline = parse(line);
  GstElement* sink = named(pipeline, "sink");
  gst_element_set_state(pipeline, GST_STATE_PAUSED);
  gst_element_get_state(pipeline, nullptr, nullptr, 15 * GST_SECOND);
  std::vector<std::uint8_t> bytes;
  GstClockTime time = 0;
  for (const int frame : {50, 20, 21, 0}) {
    fail_unless(gst_element_seek_simple(
        pipeline, GST_FORMAT_TIME,
        static_cast<GstSeekFlags>(GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE),
        frame * frame_time));
    gst_element_get_state(pipeline, nullptr, nullptr, 15 * GST_SECOND);
    const Mesh mesh = mesh_at(sink, time, bytes);
    fail_unless_equals_uint64(mesh.trigger, frame);
    fail_unless_equals_uint64(time, frame * frame_time);
    fail_unless_equals_int(mesh.views.size(), 2);
  }
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
}

ELEMENT_TEST(test_live_change_of_rig) {
  Bench bench;
  for (int i = 0; i < 4; ++i) bench.push_box(i, 0);
  bench.pull();
  Rig rig = default_rig();
  rig.unit = "mm";
  for (Camera& camera : rig.cameras) camera.t *= 1000.0;
  rig.bounds.reset();
  const std::string path = folder.file("metric.json");
  std::ofstream(path) << rig_to_json(rig);
  g_object_set(bench.element, "rig", path.c_str(), nullptr);
  for (int i = 0; i < 4; ++i) bench.push_box(i, 1);
  const auto mesh = bench.pull();
  fail_unless_equals_float(mesh->metres_per_unit, 0.001);
  fail_unless(enclosed_volume(mesh->hull) > 1e8);
  // A rig that cannot be used leaves the former one in place.
  g_object_set(bench.element, "rig", "/nowhere/rig.json", nullptr);
  for (int i = 0; i < 4; ++i) bench.push_box(i, 2);
  fail_unless_equals_float(bench.pull()->metres_per_unit, 0.001);
  fail_unless_equals_uint64(bench.count("rigs-refused"), 1);
}

ELEMENT_TEST(test_gaps_and_ends) {
  Bench bench("missing-camera=drop-camera", 3);
  bench.push_box(0, 0);
  bench.push_box(1, 0);
  gst_harness_push_event(bench.inputs[2], gst_event_new_gap(0, frame_time));
  fail_unless_equals_int(bench.pull()->views.size(), 2);
  for (int i = 0; i < 3; ++i) bench.push_box(i, 1);
  fail_unless_equals_int(bench.pull()->views.size(), 3);
  gst_harness_push_event(bench.inputs[0], gst_event_new_eos());
  for (int i = 1; i < 3; ++i) bench.push_box(i, 2);
  fail_unless_equals_int(bench.pull()->views.size(), 2);
  for (int i = 1; i < 3; ++i) gst_harness_push_event(bench.inputs[i], gst_event_new_eos());
  GstEvent* event = nullptr;
  do {
    if (event != nullptr) gst_event_unref(event);
    event = gst_harness_pull_event(bench.output);
    fail_unless(event != nullptr, "no EOS");
  } while (GST_EVENT_TYPE(event) != GST_EVENT_EOS);
  gst_event_unref(event);
}

ELEMENT_TEST(test_unchanged_silhouettes_are_not_built_again) {
  Bench bench;
  std::vector<std::uint32_t> triangles;
  for (int frame = 0; frame < 5; ++frame) {
    for (int i = 0; i < 4; ++i) bench.push_box(i, frame);
    const auto mesh = bench.pull();
    if (frame == 0) triangles = mesh->hull.triangles;
    fail_unless(mesh->hull.triangles == triangles);
    fail_unless_equals_uint64(mesh->trigger, frame);
  }
  fail_unless_equals_uint64(bench.count("hulls-reused"), 4);
  // Times are the last set's, which was not built.
  fail_unless_equals_float(figure(bench.element, "faces-ms"), 0.0);
  fail_unless_equals_float(figure(bench.element, "threads-used"), 1.0);
  fail_unless(bench.count("contour-vertices") > 0);
}

/// Also where the silhouettes, and so the hull, stay the same.
ELEMENT_TEST(test_weld_distance_is_live) {
  Bench bench;
  std::size_t vertices[4];
  for (int frame = 0; frame < 4; ++frame) {
    g_object_set(bench.element, "weld-distance", frame == 2 ? 0.3 : 0.0, nullptr);
    for (int i = 0; i < 4; ++i) bench.push_box(i, frame);
    vertices[frame] = bench.pull()->hull.vertices.size();
  }
  fail_unless_equals_uint64(bench.count("hulls-reused"), 3);
  fail_unless(vertices[2] < vertices[0] && vertices[1] == vertices[0] && vertices[3] == vertices[0],
              "%zu, %zu, %zu, %zu vertices", vertices[0], vertices[1], vertices[2], vertices[3]);
}

ELEMENT_TEST(test_the_earliest_capture_time_is_the_meshs) {
  Bench bench("", 3);
  const std::int64_t times[][3] = {
      {500, 300, 400}, {500, 600, 400}, {no_time, 900, 800}, {no_time, no_time, no_time}};
  const std::int64_t expected[] = {300, 400, 800, no_time};
  for (int frame = 0; frame < 4; ++frame) {
    for (int i = 0; i < 3; ++i) {
      std::vector<std::uint8_t> pixels;
      View view = box_view(bench.rig.cameras[i], {}, frame, pixels);
      view.capture_time = times[frame][i];
      bench.push(i, view, frame * frame_time);
    }
    fail_unless_equals_int64(bench.pull()->capture_time, expected[frame]);
  }
}

/// Only what fills all but half a per cent is no silhouette.
ELEMENT_TEST(test_a_large_silhouette_is_not_a_full_one) {
  Bench bench("", 3);
  const auto push = [&](int frame, float height) {
    std::vector<std::uint8_t> pixels;
    for (int i = 0; i < 3; ++i) {
      View view = box_view(bench.rig.cameras[i], {}, frame, pixels);
      if (i == 0) {
        const float bottom = height * 768.0f - 0.5f;
        view.contours.points = {
            {-0.5f, -0.5f}, {-0.5f, bottom}, {1023.5f, bottom}, {1023.5f, -0.5f}};
        view.contours.ends = {4};
      }
      bench.push(i, view, frame * frame_time);
    }
    bench.pull();
    return bench.count("full-silhouettes");
  };
  fail_unless_equals_uint64(push(0, 0.6f), 0);
  fail_unless_equals_uint64(push(1, 0.993f), 0);
  fail_unless_equals_uint64(push(2, 0.997f), 1);
}

ELEMENT_TEST(test_what_the_rig_says_goes_along) {
  Bench bench("", 3);
  Rig rig = default_rig();
  rig.up = Vec3(0.0, 0.6, 0.8);
  rig.unit = "ft";
  const std::string path = folder.file("leaning.json");
  std::ofstream(path) << rig_to_json(rig);
  g_object_set(bench.element, "rig", path.c_str(), nullptr);
  for (int i = 0; i < 3; ++i) bench.push_box(i, 0);
  const auto mesh = bench.pull();
  fail_unless(glm::length(mesh->up - rig.up) < 1e-9);
  fail_unless_equals_float(mesh->metres_per_unit, 0.3048);
  fail_unless_equals_uint64(GST_BUFFER_DURATION(bench.last.get()), frame_time);
}

/// The box reaches out of the rig's bounds, which cut it only where use-bounds says so.
ELEMENT_TEST(test_bounds_cut_where_they_are_used) {
  double volumes[2];
  for (const bool used : {false, true}) {
    Bench bench(used ? "use-bounds=true" : "use-bounds=false");
    Box box;
    box.centre.y = bench.rig.bounds->min.y;
    for (int i = 0; i < 4; ++i) bench.push_box(i, 0, box);
    const auto mesh = bench.pull();
    fail_unless(is_closed(mesh->hull));
    volumes[used] = enclosed_volume(mesh->hull);
    double low = 1e9;
    for (const Vec3f& v : mesh->hull.vertices) low = std::min(low, mesh->hull.origin.y + v.y);
    fail_unless(used == (low > box.centre.y - 0.01), "lowest %g", low);
  }
  fail_unless(volumes[1] < 0.7 * volumes[0], "%g of %g", volumes[1], volumes[0]);
}

/// The silhouette of a round thing, in many short edges.
static View disc_view(const Camera& camera, std::uint64_t trigger,
                      std::vector<std::uint8_t>& pixels) {
  View view = box_view(camera, {}, trigger, pixels);
  const Vec2 middle = *camera.project({0.0, 1.0, 0.0});
  view.contours.points.clear();
  for (int i = 0; i < 240; ++i) {
    const double angle = -2.0 * std::numbers::pi * i / 240;
    view.contours.points.push_back(Vec2f(middle + 150.0 * Vec2(std::cos(angle), std::sin(angle))));
  }
  view.contours.ends = {240};
  return view;
}

ELEMENT_TEST(test_max_deviation_leaves_vertices_out) {
  std::size_t triangles[2];
  double volumes[2];
  for (int frame = 0; frame < 2; ++frame) {
    Bench bench(frame == 0 ? "max-deviation=0" : "max-deviation=0.05");
    std::vector<std::uint8_t> pixels;
    for (int i = 0; i < 4; ++i) bench.push(i, disc_view(bench.rig.cameras[i], frame, pixels), 0);
    const auto mesh = bench.pull();
    triangles[frame] = mesh->hull.triangles.size();
    volumes[frame] = enclosed_volume(mesh->hull);
  }
  // Few, for cameras that do not face each other leave few slivers.
  fail_unless(triangles[1] < 98 * triangles[0] / 100, "%zu of %zu", triangles[1], triangles[0]);
  fail_unless(std::abs(volumes[1] / volumes[0] - 1.0) < 0.05);
}

/// The hull's faces name edges of the contours as they came, not as the lens' correction cut them.
ELEMENT_TEST(test_faces_name_the_edges_that_came) {
  Bench bench;
  Rig rig = default_rig();
  for (Camera& camera : rig.cameras) camera.distortion = {-0.15, 0.02, 0.0, 0.0};
  const std::string path = folder.file("bent.json");
  std::ofstream(path) << rig_to_json(rig);
  g_object_set(bench.element, "rig", path.c_str(), nullptr);
  for (int i = 0; i < 4; ++i) bench.push_box(i, 0);
  const auto mesh = bench.pull();
  fail_if(mesh->hull.empty());
  bool cut = false;
  for (const MeshView& view : mesh->views)
    cut |= undistort_rings(view.calibration, view.view.contours).rings.points.size() >
           view.view.contours.points.size();
  fail_unless(cut, "the lens bends these edges too little to be cut");
  for (const HullFace& face : mesh->hull.faces) {
    if (face.view < 0) continue;
    fail_unless(face.edge < mesh->views[face.view].view.contours.points.size(), "edge %u of %zu",
                face.edge, mesh->views[face.view].view.contours.points.size());
  }
}

ELEMENT_TEST(test_states_and_two_pipelines) {
  const std::string files = write_view_files(folder.file("files"), 3);
  const std::string line = "hullbuild name=hull ! fakesink " + all_view_files(files);
  check_states(line, 50);
  GstElement* pipelines[] = {parse(line), parse(line)};
  for (GstElement* pipeline : pipelines) gst_element_set_state(pipeline, GST_STATE_PLAYING);
  for (GstElement* pipeline : pipelines) {
    check_ended(wait_for_end(pipeline));
    GstElement* hull = named(pipeline, "hull");
    fail_unless_equals_uint64(statistic(hull, "sets"), 3);
    stop(pipeline);
  }
}

ELEMENT_TEST(test_cameras_come_and_go) {
  Bench bench("missing-camera=drop-camera", 2);
  for (int frame = 0; frame < 3; ++frame) {
    for (int i = 0; i < 2; ++i) bench.push_box(i, frame);
    fail_unless_equals_int(bench.pull()->views.size(), 2);
  }
  GstHarness* third = gst_harness_new_with_element(bench.element, "sink_%u", nullptr);
  gst_harness_set_live(third, FALSE);
  gst_harness_set_src_caps_str(third, "application/x-polyhull-view");
  bench.inputs.push_back(third);
  for (int i = 0; i < 3; ++i) bench.push_box(i, 3);
  fail_unless_equals_int(bench.pull()->views.size(), 3);
  bench.inputs.pop_back();
  gst_harness_teardown(third);  // releases its pad
  fail_unless_equals_int(bench.element->numsinkpads, 2);
  for (int i = 0; i < 2; ++i) bench.push_box(i, 4);
  fail_unless_equals_int(bench.pull()->views.size(), 2);
}
