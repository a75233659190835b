// SPDX-License-Identifier: LGPL-2.1-or-later
// composite subject=image-based: silhouettes drawn without a mesh's triangles.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "box_views.h"
#include "composite_bench.h"
#include "element_test.h"
#include "hull/build/stage.h"
#include "hull/camera_contours.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

/// The views of a box by the built-in rig, and their hull if it is wanted.
Mesh box_mesh(bool with_hull) {
  static const Rig rig = default_rig();
  Mesh mesh;
  for (const Camera& camera : rig.cameras) {
    MeshView& view = mesh.views.emplace_back();
    view.calibration = camera;
    view.view.camera = camera.name;
    view.view.width = camera.width;
    view.view.height = camera.height;
    view.view.contours = box_contours(camera, {});
  }
  if (with_hull) {
    std::vector<CameraContours> contours;
    for (const MeshView& view : mesh.views)
      contours.push_back({&view.calibration, &view.view.contours});
    HullStage stage;
    mesh.hull = stage.build(contours, {}, 0.0);
  }
  return mesh;
}

struct ImageBench : Bench {
  GstBus* bus = gst_bus_new();
  int frames = 0;
  explicit ImageBench(const char* subject, const char* backend = "processor") {
    wait_for_all();
    gst_element_set_bus(element, bus);
    set("backend", backend);
    set("subject", subject);
  }
  ~ImageBench() {
    gst_element_set_bus(element, nullptr);
    gst_object_unref(bus);
  }
  void set(const char* property, const char* value) {
    gst_util_set_object_arg(G_OBJECT(element), property, value);
  }
  /// A frame made with \p shown; \p next is the mesh of the frame to come.
  std::vector<std::uint8_t> draw(const Mesh& shown, const Mesh& next) {
    if (frames == 0) gst_harness_push(mesh, mesh_buffer(0, shown));
    GstBuffer* out = step(frame(frame_time(frames)), mesh_buffer(frame_time(frames + 1), next));
    ++frames;
    return bytes_taken(out);
  }
  /// The texts of the warnings since the last call.
  std::vector<std::string> warnings() { return warnings_on(bus); }
};

/// How many pixels are not the background's; and of how many one of two pictures says so alone.
int changed(const std::vector<std::uint8_t>& bytes) {
  int count = 0;
  for (std::size_t i = 0; i < bytes.size(); i += 4) count += bytes[i] != grey;
  return count;
}

int apart(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  int count = 0;
  for (std::size_t i = 0; i < a.size(); i += 4) count += (a[i] != grey) != (b[i] != grey);
  return count;
}

/// The least and the most level of what is not the background's.
std::pair<int, int> levels_of(const std::vector<std::uint8_t>& bytes) {
  std::pair<int, int> levels(255, 0);
  for (std::size_t i = 0; i < bytes.size(); i += 4)
    if (bytes[i] != grey)
      levels = {std::min<int>(levels.first, bytes[i]), std::max<int>(levels.second, bytes[i])};
  return levels;
}

/// By how many levels they differ where both show the subject, in the mean.
double levels_apart(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  double sum = 0.0, count = 0.0;
  for (std::size_t i = 0; i < a.size(); i += 4)
    if (a[i] != grey && b[i] != grey) {
      sum += std::abs(a[i] - b[i]);
      ++count;
    }
  return sum / count;
}

}  // namespace

ELEMENT_TEST(test_draws_what_the_mesh_shows) {
  const Mesh whole = box_mesh(true), views = box_mesh(false);
  ImageBench by_mesh("mesh"), by_image("image-based");
  const auto wanted = by_mesh.draw(whole, whole), drawn = by_image.draw(views, views);
  fail_unless(changed(wanted) > 500);
  fail_unless(100 * apart(wanted, drawn) <= changed(wanted), "%d of %d", apart(wanted, drawn),
              changed(wanted));
  // Neither has pictures: both are shaded, as bright as they face the viewport.
  const auto [least, most] = levels_of(wanted);
  fail_unless(most - least > 20, "%d to %d", least, most);
  fail_unless(levels_apart(wanted, drawn) < 2.0, "%g levels", levels_apart(wanted, drawn));
  fail_unless_equals_uint64(statistic(by_image.element, "image-based"), 1);
  fail_unless_equals_uint64(statistic(by_mesh.element, "image-based"), 0);
  // The same mesh's triangles are not looked at.
  ImageBench both("image-based");
  fail_unless(both.draw(whole, whole) == drawn);
}

ELEMENT_TEST(test_switches_while_playing) {
  const Mesh whole = box_mesh(true), views = box_mesh(false);
  ImageBench bench("image-based");
  const auto by_image = bench.draw(whole, whole);
  bench.set("subject", "mesh");
  const auto by_mesh = bench.draw(whole, views);
  fail_unless(changed(by_mesh) > 500);
  fail_unless(bench.warnings().empty());
  // Without triangles there is nothing to see, and it is said why.
  fail_unless_equals_int(changed(bench.draw(views, views)), 0);
  const std::vector<std::string> said = bench.warnings();
  fail_unless_equals_int(said.size(), 1);
  fail_unless(said[0].find("subject=image-based") != std::string::npos, "%s", said[0].c_str());
  bench.set("subject", "image-based");
  fail_unless(bench.draw(views, views) == by_image);
}

ELEMENT_TEST(test_what_is_empty_stays_empty) {
  ImageBench bench("image-based");
  const Mesh views = box_mesh(false);
  Mesh one_empty = views, none;
  one_empty.views[1].view.contours.clear();
  Mesh lone = views;
  lone.views.resize(1);
  fail_unless_equals_int(changed(bench.draw(one_empty, none)), 0);
  fail_unless_equals_int(changed(bench.draw(none, lone)), 0);
  fail_unless_equals_int(changed(bench.draw(lone, views)), 0);
  fail_unless(changed(bench.draw(views, views)) > 500);
  fail_unless(bench.warnings().empty());
}

ELEMENT_TEST(test_hostile_contours_do_no_harm) {
  ImageBench bench("image-based");
  const Mesh views = box_mesh(false);
  Mesh point = views, thin = views, wild = views;
  for (Vec2f& p : point.views[1].view.contours.points) p = {400.0f, 300.0f};
  thin.views[2].view.contours.points = {{300.0f, 100.0f}, {300.0f, 600.0f}, {300.0f, 300.0f}};
  thin.views[2].view.contours.ends = {3};
  Rings& rings = wild.views[0].view.contours;
  rings.points = {{-9e5f, -9e5f}, {9e5f, 9e5f}, {9e5f, -9e5f}, {-9e5f, 9e5f}, {1e-3f, 2e-3f}};
  rings.ends = {5};
  fail_unless_equals_int(changed(bench.draw(point, thin)), 0);
  fail_unless_equals_int(changed(bench.draw(thin, wild)), 0);
  bench.draw(wild, views);
  fail_unless(changed(bench.draw(views, views)) > 500);
}

ELEMENT_TEST(test_opengl_draws_the_triangles_and_says_so) {
  const Mesh whole = box_mesh(true);
  ImageBench bench("image-based", "gl"), by_mesh("mesh", "gl");
  fail_unless(bench.draw(whole, whole) == by_mesh.draw(whole, whole));
  const std::vector<std::string> said = bench.warnings();
  fail_unless_equals_int(said.size(), 1);
  fail_unless(said[0].find("backend=processor") != std::string::npos, "%s", said[0].c_str());
  // With a choice it is the processor.
  ImageBench chosen("image-based", "auto");
  chosen.draw(whole, whole);
  fail_unless_equals_uint64(statistic(chosen.element, "drawn-by-processor"), 1);
  fail_unless(chosen.warnings().empty());
}
