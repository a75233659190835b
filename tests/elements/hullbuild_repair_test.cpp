// SPDX-License-Identifier: LGPL-2.1-or-later
// hullbuild repair=…: one camera's matte has a hole, another a speck of background.
#include <algorithm>

#include "element_test.h"
#include "hull/measure.h"
#include "hull_bench.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

/// The built-in rig, but cam3 looks at cam1, whose hole it can prove wrong.
struct FacingBench : Bench {
  explicit FacingBench(const std::string& properties = "")
      : Bench("rig=" + file() + " " + properties) {
    rig = facing();
  }
  static Rig facing() {
    Rig rig = default_rig();
    rig.cameras[3].R = rig.cameras[1].R * Mat3(-1, 0, 0, 0, 1, 0, 0, 0, -1);
    rig.cameras[3].t = rig.cameras[1].t;
    return rig;
  }
  static std::string file() {
    const std::string path = folder.file("facing") + ".json";
    std::ofstream(path) << rig_to_json(facing());
    return path;
  }
};

float hole_size = 25.0f;  // px

/// A square of \p size px around \p middle, as a ring of foreground or of a hole.
void add_square(Rings& rings, const Vec2f& middle, float size, bool hole) {
  std::vector<Vec2f> ring{middle + Vec2f(-size, -size), middle + Vec2f(-size, size),
                          middle + Vec2f(size, size), middle + Vec2f(size, -size)};
  if (hole) std::reverse(ring.begin(), ring.end());
  rings.points.insert(rings.points.end(), ring.begin(), ring.end());
  rings.ends.push_back(static_cast<std::uint32_t>(rings.points.size()));
}

/// A frame in which cam1's silhouette of a box has a hole, and cam2's a speck beside it.
void push_spoilt(Bench& bench, int frame, bool spoilt = true) {
  for (int i = 0; i < 4; ++i) {
    const Camera& camera = bench.rig.cameras[i];
    std::vector<std::uint8_t> pixels;
    View view = box_view(camera, {}, static_cast<std::uint64_t>(frame), pixels);
    const Vec2f middle(*camera.project(Box().centre));
    if (spoilt && i == 1) add_square(view.contours, middle, hole_size, true);
    if (spoilt && i == 2) add_square(view.contours, middle + Vec2f(300.0f, 0.0f), 8.0f, false);
    bench.push(i, view, static_cast<GstClockTime>(frame) * frame_time);
  }
}

double volume_of(const std::string& properties, bool spoilt = true) {
  FacingBench bench(properties);
  push_spoilt(bench, 0, spoilt);
  return enclosed_volume(bench.pull()->hull);
}

}  // namespace

ELEMENT_TEST(test_off_by_default) {
  FacingBench bench;
  push_spoilt(bench, 0);
  const auto mesh = bench.pull();
  fail_unless_equals_int(mesh->views[1].view.contours.size(), 2);
  fail_unless_equals_int(mesh->views[2].view.contours.size(), 2);
  fail_unless_equals_uint64(bench.count("holes-filled"), 0);
  fail_unless(enclosed_volume(mesh->hull) < 0.99 * volume_of("", false));
}

ELEMENT_TEST(test_holes_are_filled) {
  FacingBench bench("repair=holes");
  push_spoilt(bench, 0);
  const auto mesh = bench.pull();
  // The faces' edges are those of the contours that the mesh carries.
  fail_unless(mesh->views[1].view.contours == box_contours(bench.rig.cameras[1], {}));
  fail_unless_equals_int(mesh->views[2].view.contours.size(), 2);
  fail_unless(enclosed_volume(mesh->hull) == volume_of("", false));
  fail_unless_equals_uint64(bench.count("holes-filled"), 1);
  fail_unless_equals_uint64(bench.count("holes-filled-cam1"), 1);
  fail_unless_equals_uint64(bench.count("holes-filled-cam0"), 0);
  fail_unless_equals_uint64(bench.count("pieces-dropped"), 0);
  fail_unless(figure(bench.element, "repair-ms") > 0.0);
}

ELEMENT_TEST(test_without_a_surface_nothing_is_built) {
  FacingBench bench("surface=none repair=both");
  push_spoilt(bench, 0);
  const auto views = bench.pull();
  fail_unless(views->hull.empty() && views->hull.vertices.empty());
  fail_unless_equals_int(views->views.size(), 4);
  for (int i = 0; i < 4; ++i) fail_unless(!views->views[i].view.pixels.empty());
  fail_unless(views->views[0].view.contours == box_contours(bench.rig.cameras[0], {}));
  fail_unless_equals_int(views->views[1].view.contours.size(), 2);  // nothing is mended
  fail_unless_equals_uint64(bench.count("empty-meshes"), 0);
  fail_unless_equals_uint64(bench.count("predicates"), 0);
  fail_unless(bench.warnings().empty());
  gst_util_set_object_arg(G_OBJECT(bench.element), "surface", "polyhedral");
  push_spoilt(bench, 1);
  fail_unless(enclosed_volume(bench.pull()->hull) == volume_of("", false));
}

ELEMENT_TEST(test_pieces_are_dropped) {
  FacingBench bench("repair=both");
  push_spoilt(bench, 0);
  const auto mesh = bench.pull();
  for (int i = 0; i < 4; ++i)
    fail_unless(mesh->views[i].view.contours == box_contours(bench.rig.cameras[i], {}));
  fail_unless_equals_uint64(bench.count("pieces-dropped"), 1);
  fail_unless_equals_uint64(bench.count("pieces-dropped-cam2"), 1);
}

/// A hole so small that it leaves no silhouette uncovered may be a gap.
ELEMENT_TEST(test_what_is_not_proven_stays) {
  hole_size = 8.0f;
  const double torn = volume_of("");
  fail_unless(volume_of("repair=holes") == torn);
  hole_size = 25.0f;
  fail_unless(volume_of("repair=holes") > torn);
}

ELEMENT_TEST(test_bytes_of_sound_silhouettes_stay) {
  std::vector<std::uint8_t> bytes[2];
  for (const bool on : {false, true}) {
    FacingBench bench(on ? "repair=both" : "");
    push_spoilt(bench, 0, false);
    bench.pull();
    bytes[on] = bench.bytes;
  }
  fail_unless(bytes[0] == bytes[1]);
}

ELEMENT_TEST(test_can_be_changed_while_playing) {
  FacingBench bench("");
  int frame = 0;
  for (const char* value : {"off", "holes", "both", "off"}) {
    gst_util_set_object_arg(G_OBJECT(bench.element), "repair", value);
    push_spoilt(bench, frame++);
    const auto mesh = bench.pull();
    const std::string repair = value;
    fail_unless_equals_int(mesh->views[1].view.contours.size(), repair == "off" ? 2 : 1);
    fail_unless_equals_int(mesh->views[2].view.contours.size(), repair == "both" ? 1 : 2);
  }
}

ELEMENT_TEST(test_what_lasts_is_said_once) {
  FacingBench bench("repair=both");
  int frame = 0;
  // Two seconds, a pause of two seconds, two seconds: nothing lasts.
  for (int i = 0; i < 150; ++i) {
    push_spoilt(bench, frame++, i < 50 || i >= 100);
    bench.pull();
  }
  fail_unless(bench.warnings().empty());
  // One good frame in between is no end.
  for (int i = 0; i < 20; ++i) {
    push_spoilt(bench, frame++, i != 0);
    bench.pull();
  }
  fail_unless(bench.warnings().empty());
  for (int i = 0; i < 50; ++i) {
    push_spoilt(bench, frame++);
    bench.pull();
  }
  const auto warnings = bench.warnings();
  fail_unless_equals_int(warnings.size(), 2);
  expect_in(warnings[0], {"camera cam1", "3.0 s", "1 holes are filled, 0 pieces"});
  expect_in(warnings[1], {"camera cam2", "3.0 s", "0 holes are filled, 1 pieces"});
}
