// SPDX-License-Identifier: LGPL-2.1-or-later
#include <cmath>
#include <vector>

#include "refine/refine.h"
#include "synthetic.h"
#include "texture/texture_hull.h"
#include "wire/mesh_payload.h"

// After the standard library's headers: gst-check has a macro fail.
#include <gst/check/gstharness.h>

#include "element_checks.h"
#include "hull/build/stage.h"
#include "mesh_buffers.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

constexpr int cameras = 5;

/// The octagon around what a camera sees of a ball of radius .4 m at height 1.
Rings octagon(const Camera& camera) {
  const Vec2 middle = *camera.project_ideal({0.0, 1.0, 0.0});
  const double radius = 0.4 * camera.K[0][0] / glm::length(camera.centre() - Vec3(0.0, 1.0, 0.0));
  Rings rings;
  for (int i = 0; i < 8; ++i) {
    const double angle = -2.0 * std::numbers::pi * i / 8.0;  // counter-clockwise as seen on screen
    rings.points.emplace_back(middle + radius * Vec2(std::cos(angle), std::sin(angle)));
  }
  rings.ends = {8};
  return rings;
}

const Mesh& subject() {
  static const Mesh made = [] {
    Mesh mesh;
    std::vector<CameraContours> views;
    for (const Camera& camera : synthetic::ring(cameras, 3.0, 1.2, {0, 1, 0})) {
      MeshView view;
      view.calibration = camera;
      view.view.camera = camera.name;
      view.view.width = camera.width;
      view.view.height = camera.height;
      view.view.contours = octagon(camera);
      mesh.views.push_back(view);
    }
    for (const MeshView& view : mesh.views)
      views.push_back({&view.calibration, &view.view.contours});
    mesh.hull = HullStage().build(views, {}, 0.0);
    return mesh;
  }();
  return made;
}

/// hullrefine fed by hand.
struct Bench {
  explicit Bench(const char* launch = "hullrefine") : harness(gst_harness_new_parse(launch)) {
    gst_harness_set_src_caps_str(harness, mesh_caps);
    gst_harness_set_sink_caps_str(harness, mesh_caps);
    element = gst_harness_find_element(harness, "hullrefine");
    gst_element_set_bus(element, bus);
  }
  ~Bench() {
    gst_element_set_bus(element, nullptr);
    gst_object_unref(bus);
    gst_object_unref(element);
    gst_harness_teardown(harness);
  }
  Mesh refine(const Mesh& mesh, GstClockTime time = 0) {
    GstBuffer* out = gst_harness_push_and_pull(harness, mesh_buffer(mesh, time));
    fail_unless_equals_uint64(GST_BUFFER_PTS(out), time);
    fail_unless_equals_uint64(GST_BUFFER_DURATION(out), 40 * GST_MSECOND);
    GstMapInfo map;
    fail_unless(gst_buffer_map(out, &map, GST_MAP_READ));
    const Mesh read = read_mesh(Bytes(map.data, map.size));
    gst_buffer_unmap(out, &map);
    gst_buffer_unref(out);
    return read;
  }
  bool warned(const char* words) {
    GstMessage* message = gst_bus_pop_filtered(bus, GST_MESSAGE_WARNING);
    if (!message) return false;
    GError* error = nullptr;
    gst_message_parse_warning(message, &error, nullptr);
    const bool found = g_strrstr(error->message, words) != nullptr;
    g_error_free(error);
    gst_message_unref(message);
    return found;
  }
  GstHarness* harness;
  GstElement* element;
  GstBus* bus = gst_bus_new();
};

Hull refined(const RefineSettings& settings) {
  std::vector<CameraContours> views;
  for (const MeshView& view : subject().views)
    views.push_back({&view.calibration, &view.view.contours});
  return HullRefiner().refine(subject().hull, views, 1.0, settings);
}

}  // namespace

ELEMENT_TEST(puts_the_surface_in_the_hulls_place) {
  Bench bench;
  const Mesh out = bench.refine(subject(), 3 * GST_SECOND);
  const Hull expected = refined({});
  fail_unless(out.hull.vertices == expected.vertices && out.hull.normals == expected.normals);
  fail_unless(out.hull.triangles == expected.triangles);
  fail_unless_equals_int(static_cast<int>(out.views.size()), cameras);
  fail_unless(out.views[1].view.contours == subject().views[1].view.contours);
  fail_unless(test::statistic(bench.element, "meshes") == 1);
  fail_unless(test::statistic(bench.element, "rays") > 100);
}

ELEMENT_TEST(properties_take_effect_on_the_next_mesh) {
  Bench bench("hullrefine cell=0.05 quality=fast");
  const RefineSettings coarse{.quality = RefineQuality::fast, .cell = 0.05};
  fail_unless(bench.refine(subject()).hull.vertices == refined(coarse).vertices);
  fail_unless(bench.refine(subject()).hull.vertices == refined(coarse).vertices);
  fail_unless_equals_uint64(test::statistic(bench.element, "surfaces-reused"), 1);
  g_object_set(bench.element, "cell", 0.0, nullptr);
  gst_util_set_object_arg(G_OBJECT(bench.element), "quality", "fine");
  fail_unless(bench.refine(subject()).hull.vertices ==
              refined({.quality = RefineQuality::fine}).vertices);
  gst_util_set_object_arg(G_OBJECT(bench.element), "quality", "off");
  const Mesh off = bench.refine(subject());
  fail_unless(off.hull.vertices == subject().hull.vertices && off.hull.normals.empty());
  fail_unless(off.hull.faces.size() == subject().hull.faces.size());
}

/// Without pixels the surface is made without colours, and a warning says so; with them it is what
/// the library makes of them: of grey ones nothing else, in either format.
ELEMENT_TEST(carving_by_colours_needs_pixels) {
  Bench bench("hullrefine photo=true");
  const Hull plain = refined({});
  fail_unless(bench.refine(subject()).hull.vertices == plain.vertices);
  fail_unless(bench.warned("camera cam0 sends no pixels"));
  fail_unless_equals_uint64(test::statistic(bench.element, "meshes-uncarved"), 1);
  Mesh seen = subject();
  const std::vector<std::uint8_t> even(4u * 1024 * 768, 100);
  for (MeshView& mesh_view : seen.views) {
    View& view = mesh_view.view;
    const bool grey = &mesh_view == &seen.views[1];
    view.roi = {0, 0, view.width, view.height};
    view.format = grey ? PixelFormat::grey : PixelFormat::rgba;
    view.stride = (grey ? 1 : 4) * view.width;
    view.pixels = std::span(even).first(static_cast<std::size_t>(view.stride) * view.height);
  }
  fail_unless(bench.refine(seen).hull.vertices == plain.vertices);
  fail_unless_equals_uint64(test::statistic(bench.element, "meshes-uncarved"), 1);
  fail_unless_equals_uint64(test::statistic(bench.element, "surfaces-reused"), 0);
  fail_unless(test::figure(bench.element, "photo-ms") > 0.0);
}

ELEMENT_TEST(a_texturing_of_the_hull_does_not_stay) {
  Mesh textured = subject();
  std::vector<Camera> all;
  for (const MeshView& view : textured.views) all.push_back(view.calibration);
  textured.texturing = texture_hull(textured.hull, all, {.metric = TextureMetric::camera_normal});
  Bench bench;
  fail_if(bench.refine(textured).texturing.has_value());
}

ELEMENT_TEST(an_empty_mesh_and_gaps_pass) {
  Bench bench;
  fail_unless(bench.refine(Mesh()).hull.empty());
  GstBuffer* gap = gst_buffer_new();
  GST_BUFFER_FLAG_SET(gap, GST_BUFFER_FLAG_GAP);
  GstBuffer* out = gst_harness_push_and_pull(bench.harness, gap);
  fail_unless(GST_BUFFER_FLAG_IS_SET(out, GST_BUFFER_FLAG_GAP));
  gst_buffer_unref(out);
}

ELEMENT_TEST(what_cannot_be_refined_passes_as_it_is) {
  Bench bench("hullrefine cell=0.0002");
  const Mesh out = bench.refine(subject());
  fail_unless(out.hull.vertices == subject().hull.vertices);
  fail_unless_equals_uint64(test::statistic(bench.element, "meshes-unrefined"), 1);
  fail_unless(bench.warned("give a cell of 0.00"));
  g_object_set(bench.element, "cell", 0.03, nullptr);
  fail_unless(bench.refine(subject()).hull.vertices == refined({.cell = 0.03}).vertices);
}

ELEMENT_TEST(bad_payloads_are_dropped_with_a_warning) {
  Bench bench;
  std::vector<std::uint8_t> bytes = write_mesh(subject());
  for (const std::size_t size : {std::size_t{0}, std::size_t{3}, bytes.size() / 3}) {
    GstBuffer* buffer = size == 0 ? gst_buffer_new() : gst_buffer_new_memdup(bytes.data(), size);
    fail_unless_equals_int(gst_harness_push(bench.harness, buffer), GST_FLOW_OK);
  }
  fail_unless_equals_int(gst_harness_buffers_received(bench.harness), 0);
  fail_unless_equals_uint64(test::statistic(bench.element, "meshes-unusable"), 3);
  fail_unless(bench.warned("dropped"));
  bench.refine(subject());  // the stream goes on
}

ELEMENT_TEST(states_flush_and_end) {
  Bench bench;
  bench.refine(subject());
  fail_unless(gst_harness_push_event(bench.harness, gst_event_new_flush_start()));
  fail_unless(gst_harness_push_event(bench.harness, gst_event_new_flush_stop(TRUE)));
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  fail_unless(gst_harness_push_event(bench.harness, gst_event_new_segment(&segment)));
  bench.refine(subject());
  fail_unless_equals_uint64(test::statistic(bench.element, "surfaces-reused"), 1);
  fail_unless(gst_harness_push_event(bench.harness, gst_event_new_eos()));
}
