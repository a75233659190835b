// SPDX-License-Identifier: LGPL-2.1-or-later
#include <gst/check/gstharness.h>

#include <memory>
#include <vector>

#include "element_checks.h"
#include "mesh/texture_mesh.h"
#include "mesh_buffers.h"
#include "synthetic.h"
#include "wire/mesh_payload.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

const synthetic::Photographed& subject() {
  static const synthetic::Photographed made = synthetic::photographed(
      synthetic::figure(8), synthetic::ring(3, 3.2, 1.5, {0, 1, 0}, 128, 128, 45.0));
  return made;
}

GstHarness* harness(const char* launch = "hulltexture") {
  GstHarness* h = gst_harness_new_parse(launch);
  gst_harness_set_src_caps_str(h, mesh_caps);
  gst_harness_set_sink_caps_str(h, mesh_caps);
  return h;
}

/// A mesh read from a buffer with the memory that its pixels borrow from.
struct Read {
  explicit Read(GstBuffer* buffer) : buffer(buffer) {
    fail_unless(gst_buffer_map(buffer, &map, GST_MAP_READ));
    mesh = read_mesh(Bytes(map.data, map.size));
  }
  ~Read() {
    gst_buffer_unmap(buffer, &map);
    gst_buffer_unref(buffer);
  }
  GstBuffer* buffer;
  GstMapInfo map;
  Mesh mesh;
};

}  // namespace

// Between elements of one process a mesh is an object; its bytes come when somebody reads them,
// whole or in parts, and an element that gets only those makes the same of them.
ELEMENT_TEST(bytes_are_made_when_they_are_read) {
  GstHarness* h = harness();
  GstBuffer* buffer = gst_harness_push_and_pull(h, mesh_buffer(subject().mesh, 0));
  fail_unless(gst_memory_is_type(gst_buffer_peek_memory(buffer, 0), "polyhull-mesh"));
  // As an object, through a second element (which makes the texturing anew).
  GstHarness* second = harness();
  Read again(gst_harness_push_and_pull(second, gst_buffer_ref(buffer)));
  // A part, before the whole has been read.
  GstBuffer* part = gst_buffer_copy_region(buffer, GST_BUFFER_COPY_MEMORY, 32, 100);
  fail_unless_equals_uint64(gst_buffer_get_size(part), 100);
  GstBuffer* copied = gst_buffer_copy_deep(buffer);
  fail_if(gst_memory_is_type(gst_buffer_peek_memory(copied, 0), "polyhull-mesh"));
  const gsize size = gst_buffer_get_size(buffer);
  Read whole(buffer);
  fail_unless_equals_uint64(whole.map.size, size);
  fail_unless(gst_buffer_memcmp(part, 0, whole.map.data + 32, 100) == 0);
  fail_unless(gst_buffer_memcmp(copied, 0, whole.map.data, size) == 0);
  fail_unless(gst_buffer_memcmp(again.buffer, 0, whole.map.data, size) == 0);
  const std::vector<std::uint8_t> bytes = write_mesh(whole.mesh);
  fail_unless(bytes.size() == size && std::equal(bytes.begin(), bytes.end(), whole.map.data));
  gst_buffer_unref(part);
  gst_buffer_unref(copied);
  gst_harness_teardown(second);
  gst_harness_teardown(h);
}

ELEMENT_TEST(adds_what_the_library_computes) {
  GstHarness* h = harness();
  Read out(gst_harness_push_and_pull(h, mesh_buffer(subject().mesh, 7 * GST_SECOND)));
  fail_unless_equals_uint64(GST_BUFFER_PTS(out.buffer), 7 * GST_SECOND);
  fail_unless_equals_uint64(GST_BUFFER_DURATION(out.buffer), 40 * GST_MSECOND);
  fail_unless(out.mesh.texturing.has_value());
  std::vector<Camera> cameras;
  for (const MeshView& view : subject().mesh.views) cameras.push_back(view.calibration);
  const Texturing expected = texture_hull(subject().mesh.hull, cameras);
  fail_unless(out.mesh.texturing->metric == TextureMetric::lumigraph);
  fail_unless(out.mesh.texturing->visible == expected.visible);
  fail_unless(out.mesh.texturing->best == expected.best);
  fail_unless(out.mesh.texturing->weights == expected.weights);
  fail_unless(out.mesh.texturing->maps == expected.maps);
  fail_unless(out.mesh.hull.vertices == subject().mesh.hull.vertices);
  for (std::size_t k = 0; k < 3; ++k) {
    const View& view = out.mesh.views[k].view;
    const View& sent = subject().mesh.views[k].view;
    fail_unless(view.roi == sent.roi);
    for (int y = 0; y < view.roi.height; ++y) {
      fail_unless(
          std::equal(&view.pixels[static_cast<std::size_t>(y) * view.stride],
                     &view.pixels[static_cast<std::size_t>(y) * view.stride] + 4 * view.roi.width,
                     &sent.pixels[static_cast<std::size_t>(y) * sent.stride]));
    }
  }
  gst_harness_teardown(h);
}

ELEMENT_TEST(same_hull_is_textured_once) {
  GstHarness* h = harness();
  for (int i = 0; i < 3; ++i)
    gst_buffer_unref(gst_harness_push_and_pull(h, mesh_buffer(subject().mesh, 0)));
  GstElement* element = gst_harness_find_element(h, "hulltexture");
  fail_unless_equals_uint64(test::statistic(element, "meshes"), 3);
  fail_unless_equals_uint64(test::statistic(element, "texturings-reused"), 2);
  g_object_set(element, "cameras", 3u, nullptr);  // live: takes effect with the next mesh
  Read out(gst_harness_push_and_pull(h, mesh_buffer(subject().mesh, 0)));
  fail_unless_equals_int(out.mesh.texturing->cameras, 3);
  gst_object_unref(element);
  gst_harness_teardown(h);
}

ELEMENT_TEST(properties_reach_the_mesh) {
  GstHarness* h = harness(
      "hulltexture method=direct metric=viewing-angle occlusion=false untextured=0xffff8000");
  Read out(gst_harness_push_and_pull(h, mesh_buffer(subject().mesh, 0)));
  fail_unless(out.mesh.texturing->method == TextureMethod::direct);
  fail_unless(out.mesh.texturing->metric == TextureMetric::viewing_angle);
  fail_unless(out.mesh.texturing->untextured == Vec3f(255.0f, 128.0f, 0.0f) / 255.0f);
  fail_unless(out.mesh.texturing->maps.empty());
  gst_harness_teardown(h);
  // Those that shape the maps.
  h = harness("hulltexture fade-width=40 map-size=100 cameras=3");
  Read shaped(gst_harness_push_and_pull(h, mesh_buffer(subject().mesh, 0)));
  std::vector<Camera> cameras;
  for (const MeshView& view : subject().mesh.views) cameras.push_back(view.calibration);
  TextureSettings settings;
  settings.fade_width = 40;
  settings.map_size = 100;
  settings.cameras = 3;
  const Texturing expected = texture_hull(subject().mesh.hull, cameras, settings);
  fail_unless(shaped.mesh.texturing->maps == expected.maps);
  fail_unless(shaped.mesh.texturing->weights == expected.weights);
  fail_unless_equals_int(shaped.mesh.texturing->cameras, 3);
  gst_harness_teardown(h);
}

// The fill is the library's, and follows pictures before a hull that stays.
ELEMENT_TEST(what_is_unseen_is_filled) {
  const char* const launches[] = {"hulltexture", "hulltexture fill=nearest",
                                  "hulltexture fill=grey"};
  const TextureFill fills[] = {TextureFill::inpaint, TextureFill::nearest, TextureFill::grey};
  for (int i = 0; i < 3; ++i) {
    GstHarness* h = harness(launches[i]);
    TextureSettings settings;
    settings.fill = fills[i];
    for (const int darker : {0, 60}) {
      synthetic::Photographed sent = subject();
      for (std::size_t k = 0; k < sent.pictures.size(); ++k) {
        for (std::size_t p = 0; p < sent.pictures[k].pixels.size(); ++p)
          if (p % 4 != 3) sent.pictures[k].pixels[p] = sent.pictures[k].pixels[p] / 2 + darker;
        const auto& old = subject().mesh.views[k].view.pixels;
        const auto* first = subject().pictures[k].pixels.data();
        sent.mesh.views[k].view.pixels = {sent.pictures[k].pixels.data() + (old.data() - first),
                                          old.size()};
      }
      Read out(gst_harness_push_and_pull(h, mesh_buffer(sent.mesh, 0)));
      texture_mesh(sent.mesh, settings);
      fail_unless(out.mesh.texturing->fill == sent.mesh.texturing->fill);
      fail_unless(sent.mesh.texturing->fill.empty() == (i == 2));
    }
    gst_harness_teardown(h);
  }
}

const synthetic::Photographed& subject_of_six() {
  static const synthetic::Photographed made = synthetic::photographed(
      synthetic::figure(16), synthetic::ring(6, 3.2, 1.5, {0, 1, 0}, 256, 256, 45.0));
  return made;
}

/// The subject before six cameras at \p seconds, the first camera's codes times \p share.
struct Darker {
  synthetic::Photographed sent = subject_of_six();
  Darker(double seconds, float share) {
    sent.mesh.capture_time = static_cast<std::int64_t>(1e9 * seconds);
    for (std::size_t k = 0; k < sent.pictures.size(); ++k) {
      const auto& old = subject_of_six().mesh.views[k].view.pixels;
      std::uint8_t* own = sent.pictures[k].pixels.data() +
                          (old.data() - subject_of_six().pictures[k].pixels.data());
      sent.mesh.views[k].view.pixels = {own, old.size()};
      for (std::size_t p = 0; k == 0 && p < old.size(); ++p)
        if (p % 4 != 3) own[p] = static_cast<std::uint8_t>(share * static_cast<float>(own[p]));
    }
  }
};

// Gains are the library's, follow slowly, and begin anew with a flush.
ELEMENT_TEST(cameras_are_balanced) {
  GstHarness* h = harness("hulltexture balance=on balance-time=2");
  TextureSettings settings;
  settings.balance = true;
  settings.balance_time = 2.0;
  MeshTexturer expected;
  const auto check = [&](double seconds, float share) {
    Darker one(seconds, share);
    Read out(gst_harness_push_and_pull(h, mesh_buffer(one.sent.mesh, 0)));
    expected.texture(one.sent.mesh, settings);
    fail_unless_equals_int(out.mesh.texturing->gains.size(), 6);
    fail_unless(out.mesh.texturing->gains == one.sent.mesh.texturing->gains);
    fail_unless(out.mesh.texturing->fill == one.sent.mesh.texturing->fill);
    return out.mesh.texturing->gains[0].y;
  };
  const float even = check(5.0, 1.0f);
  fail_unless(even > 0.95f && even < 1.05f);
  const float slow = check(5.5, 0.9f);
  fail_unless(slow > even + 0.01f && slow < 1.25f, "%g, then %g", even, slow);
  fail_unless(gst_harness_push_event(h, gst_event_new_flush_start()));
  fail_unless(gst_harness_push_event(h, gst_event_new_flush_stop(TRUE)));
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  fail_unless(gst_harness_push_event(h, gst_event_new_segment(&segment)));
  expected.forget();
  fail_unless(check(6.0, 0.9f) > slow + 0.05f);
  GstElement* element = gst_harness_find_element(h, "hulltexture");
  g_object_set(element, "balance", 0, nullptr);
  Read off(gst_harness_push_and_pull(h, mesh_buffer(subject_of_six().mesh, 0)));
  fail_unless(off.mesh.texturing->gains.empty());
  gst_object_unref(element);
  gst_harness_teardown(h);
}

// The element's memory is the library's, over one flush to the next; off, there is none.
ELEMENT_TEST(colours_are_remembered) {
  GstHarness* h = harness("hulltexture memory=on memory-time=30");
  TextureSettings settings;
  settings.memory = true;
  settings.memory_time = 30.0;
  MeshTexturer expected;
  GstElement* element = gst_harness_find_element(h, "hulltexture");
  bool differs = false;
  // A ball turns once and a little before two cameras.
  Hull rest;
  synthetic::add_ellipsoid(rest, {0, 1, 0}, {0.3f, 0.42f, 0.2f}, 30);
  std::vector<Camera> cameras = synthetic::ring(4, 2.5, 1.3, {0, 1, 0}, 96, 96, 25.0);
  cameras.resize(2);
  const auto check = [&](int n) {
    // The cameras go round it instead, with the colours: to the element it is the same.
    const double a = 0.1 * n;
    const Mat3 turn(Vec3(std::cos(a), 0, -std::sin(a)), Vec3(0, 1, 0),
                    Vec3(std::sin(a), 0, std::cos(a)));
    std::vector<Camera> turned = cameras;
    for (Camera& camera : turned) camera.R = camera.R * turn;
    synthetic::Photographed seen = synthetic::photographed(rest, turned);
    for (Vec3f& v : seen.mesh.hull.vertices) v = Vec3f(turn * Vec3(v));
    for (std::size_t k = 0; k < cameras.size(); ++k) seen.mesh.views[k].calibration = cameras[k];
    seen.mesh.capture_time = 40'000'000 * n;
    Mesh plain = seen.mesh;
    expected.texture(seen.mesh, settings);
    Read out(gst_harness_push_and_pull(h, mesh_buffer(plain, 0)));
    fail_unless(out.mesh.texturing->fill == seen.mesh.texturing->fill, "at %d", n);
    texture_mesh(plain);
    differs = differs || out.mesh.texturing->fill != plain.texturing->fill;
    return test::statistic(element, "memory-points");
  };
  const auto trust = [&] {
    GstStructure* stats = nullptr;
    g_object_get(element, "stats", &stats, nullptr);
    double value = -1.0;
    fail_unless(gst_structure_get_double(stats, "memory-trust", &value));
    gst_structure_free(stats);
    return value;
  };
  guint64 points = 0;
  for (int n = 0; n < 40; ++n) points = check(n);
  fail_unless(differs);
  fail_unless(points > 0 && points == expected.memory_statistics().points);
  fail_unless(trust() == expected.memory_statistics().trust);
  fail_unless(test::statistic(element, "memory-vertices") > 0);
  fail_unless(gst_harness_push_event(h, gst_event_new_flush_start()));
  fail_unless(gst_harness_push_event(h, gst_event_new_flush_stop(TRUE)));
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  fail_unless(gst_harness_push_event(h, gst_event_new_segment(&segment)));
  expected.forget();
  check(40);
  fail_unless(trust() == 0.0);
  g_object_set(element, "memory", 0, nullptr);
  settings.memory = false;
  check(41);
  fail_unless(test::statistic(element, "memory-points") == 0);
  gst_object_unref(element);
  gst_harness_teardown(h);
}

// The flows are the library's, found anew where a picture changes, and none without align=flow.
ELEMENT_TEST(pictures_are_aligned) {
  synthetic::Photographed sent = subject_of_six();
  for (std::size_t k = 0; k < sent.pictures.size(); ++k) {
    Picture& picture = sent.pictures[k];
    for (int y = 0; y < picture.height; ++y)  // stripes that fit nowhere
      for (int x = 0; x < picture.width; ++x)
        picture.row(y)[4 * x] = (x + 3 * static_cast<int>(k)) / 6 % 2 ? 220 : 30;
    const auto& old = subject_of_six().mesh.views[k].view.pixels;
    const auto* first = subject_of_six().pictures[k].pixels.data();
    sent.mesh.views[k].view.pixels = {picture.pixels.data() + (old.data() - first), old.size()};
  }
  GstHarness* h = harness("hulltexture align=flow");
  GstElement* element = gst_harness_find_element(h, "hulltexture");
  TextureSettings settings;
  settings.align = TextureAlign::flow;
  Read out(gst_harness_push_and_pull(h, mesh_buffer(sent.mesh, 0)));
  texture_mesh(sent.mesh, settings);
  fail_if(out.mesh.texturing->flows.empty());
  fail_unless(out.mesh.texturing->flows == sent.mesh.texturing->flows);
  const auto pairs = test::statistic(element, "pairs");
  fail_unless(pairs > 0);
  fail_unless_equals_uint64(test::statistic(element, "pairs-reused"), 0);
  fail_unless_equals_uint64(test::statistic(element, "flows"), out.mesh.texturing->flows.size());
  Read again(gst_harness_push_and_pull(h, mesh_buffer(sent.mesh, 0)));
  fail_unless(again.mesh.texturing->flows == sent.mesh.texturing->flows);
  fail_unless_equals_uint64(test::statistic(element, "pairs-reused"), pairs);
  // Another picture before the same hull.
  for (std::uint8_t& value : sent.pictures[1].pixels) value = value > 128 ? value : value / 2;
  Read other(gst_harness_push_and_pull(h, mesh_buffer(sent.mesh, 0)));
  texture_mesh(sent.mesh, settings);
  fail_unless(other.mesh.texturing->flows == sent.mesh.texturing->flows);
  gst_util_set_object_arg(G_OBJECT(element), "align", "off");
  Read off(gst_harness_push_and_pull(h, mesh_buffer(sent.mesh, 0)));
  fail_unless(off.mesh.texturing->flows.empty());
  fail_unless_equals_uint64(test::statistic(element, "pairs"), 3 * pairs);
  gst_object_unref(element);
  gst_harness_teardown(h);
}

ELEMENT_TEST(empty_mesh_flows_on) {
  GstHarness* h = harness();
  Mesh empty;
  Read out(gst_harness_push_and_pull(h, mesh_buffer(empty, 0)));
  fail_unless(out.mesh.hull.empty());
  gst_harness_teardown(h);
}

ELEMENT_TEST(bad_payloads_are_dropped_with_a_warning) {
  GstHarness* h = harness();
  GstBus* bus = gst_bus_new();
  GstElement* element = gst_harness_find_element(h, "hulltexture");
  gst_element_set_bus(element, bus);
  std::vector<std::uint8_t> bytes = write_mesh(subject().mesh);
  bytes.resize(bytes.size() / 3);
  for (const std::size_t size : {std::size_t{0}, std::size_t{3}, bytes.size()}) {
    GstBuffer* buffer = size == 0 ? gst_buffer_new() : gst_buffer_new_memdup(bytes.data(), size);
    fail_unless_equals_int(gst_harness_push(h, buffer), GST_FLOW_OK);
  }
  fail_unless_equals_int(gst_harness_buffers_received(h), 0);
  fail_unless_equals_uint64(test::statistic(element, "meshes-unusable"), 3);
  GstMessage* message = gst_bus_pop_filtered(bus, GST_MESSAGE_WARNING);
  fail_unless(message != nullptr);
  gst_message_unref(message);
  gst_buffer_unref(
      gst_harness_push_and_pull(h, mesh_buffer(subject().mesh, 0)));  // the stream goes on
  gst_element_set_bus(element, nullptr);
  gst_object_unref(bus);
  gst_object_unref(element);
  gst_harness_teardown(h);
}

ELEMENT_TEST(flush_eos_and_lifetime) {
  GstHarness* h = harness();
  GstBuffer* kept = gst_harness_push_and_pull(h, mesh_buffer(subject().mesh, 0));
  fail_unless(gst_harness_push_event(h, gst_event_new_flush_start()));
  fail_unless(gst_harness_push_event(h, gst_event_new_flush_stop(TRUE)));
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  fail_unless(gst_harness_push_event(h, gst_event_new_segment(&segment)));
  gst_buffer_unref(gst_harness_push_and_pull(h, mesh_buffer(subject().mesh, 0)));
  fail_unless(gst_harness_push_event(h, gst_event_new_eos()));
  gst_harness_teardown(h);
  Read out(kept);  // outlives the element
  fail_unless(out.mesh.texturing.has_value());
}

ELEMENT_TEST(states_and_documentation) {
  GstElement* element = gst_element_factory_make("hulltexture", nullptr);
  fail_unless(element != nullptr);
  for (int i = 0; i < 50; ++i) {
    fail_unless_equals_int(gst_element_set_state(element, GST_STATE_PLAYING),
                           GST_STATE_CHANGE_SUCCESS);
    fail_unless_equals_int(gst_element_set_state(element, GST_STATE_NULL),
                           GST_STATE_CHANGE_SUCCESS);
  }
  gst_object_unref(element);
  test::check_documented("hulltexture");
}
