// SPDX-License-Identifier: LGPL-2.1-or-later
// hullbuild names the camera whose silhouettes contradict the others'.
#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>

#include "element_test.h"
#include "hull_bench.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

/// A frame of a box on its way; what camera \p off sees, if any, is 12 px lower than it should be.
void push_frame(Bench& bench, int frame, int off) {
  const Box box{{0.002 * frame, 1.0, 0.0}};
  for (int i = 0; i < 4; ++i) {
    std::vector<std::uint8_t> pixels;
    View view = box_view(bench.rig.cameras[i], box, static_cast<std::uint64_t>(frame), pixels);
    for (Vec2f& p : view.contours.points) p.y += i == off ? 12.0f : 0.0f;
    bench.push(i, view, static_cast<GstClockTime>(frame) * frame_time);
  }
  bench.pull();
}

}  // namespace

ELEMENT_TEST(test_a_bumped_camera_is_named_within_a_second) {
  Bench bench;
  int frame = 0;
  for (int i = 0; i < 50; ++i) push_frame(bench, frame++, -1);
  fail_unless(bench.warnings().empty());
  fail_unless(figure(bench.element, "contradiction-percent") < 1.0);
  fail_unless(figure(bench.element, "check-ms") > 0.0);
  for (int i = 0; i < 25; ++i) push_frame(bench, frame++, 2);
  const auto warnings = bench.warnings();
  fail_unless_equals_int(warnings.size(), 1);
  expect_in(warnings[0], {"contradict each other", "most likely camera cam2"});
  fail_unless(figure(bench.element, "contradiction-percent") > 5.0);
  // Said once while it lasts.
  for (int i = 0; i < 50; ++i) push_frame(bench, frame++, 2);
  fail_unless(bench.warnings().empty());
  for (int i = 0; i < 30; ++i) push_frame(bench, frame++, -1);
  fail_unless(figure(bench.element, "contradiction-percent") < 1.0);
}

ELEMENT_TEST(test_a_camera_two_centimetres_off_is_named_within_a_second) {
  for (const bool turned : {false, true}) {
    Bench bench;
    int frame = 0;
    for (int i = 0; i < 30; ++i) push_frame(bench, frame++, -1);
    Camera& camera = bench.rig.cameras[1];
    if (turned) {
      const Mat3 degree(glm::rotate(glm::dmat4(1.0), glm::radians(1.0), Vec3(0, 1, 0)));
      camera.R = degree * camera.R, camera.t = degree * camera.t;
    } else {
      camera.t.y += 0.02;
    }
    fail_unless(figure(bench.element, "tangency-px") < 0.3);
    fail_unless(bench.warnings().empty());
    for (int i = 0; i < 25; ++i) push_frame(bench, frame++, -1);
    const auto warnings = bench.warnings();
    fail_unless_equals_int(warnings.size(), 1);
    expect_in(warnings[0], {"most likely camera cam1", "px beside where the others have them"});
    fail_unless(figure(bench.element, "tangency-px") > 1.5);
    fail_unless(figure(bench.element, "tangency-px-cam0-cam2") < 0.3);
    fail_unless(figure(bench.element, "tangency-px-cam1-cam2") > 1.0);
  }
}

/// Frames of a box; cam2 sees a strip of background above it: beside it, or grown together with it.
static void push_with_background(Bench& bench, int frame, float width, bool grown) {
  for (int i = 0; i < 4; ++i) {
    std::vector<std::uint8_t> pixels;
    View view = box_view(bench.rig.cameras[i], Box{{0.002 * frame, 1.0, 0.0}},
                         static_cast<std::uint64_t>(frame), pixels);
    Rings& rings = view.contours;
    if (i == 2) {
      const auto top = std::min_element(rings.points.begin(), rings.points.end(),
                                        [](const Vec2f& a, const Vec2f& b) { return a.y < b.y; });
      const Vec2f p = *top;
      if (grown) {
        // Left of the top comes first, counter-clockwise as seen on screen.
        const auto at = rings.points.insert(top + 1, {p.x - 2.0f * width, p.y - 150.0f});
        rings.points.insert(at, {p.x + width, p.y - 150.0f});
        rings.ends[0] += 2;
      } else {
        const Vec2f low = p + Vec2f(60.0f, -150.0f), high = low + Vec2f(width, 130.0f);
        for (const Vec2f& q : {low, {low.x, high.y}, high, {high.x, low.y}})
          rings.points.push_back(q);
        rings.ends.push_back(static_cast<std::uint32_t>(rings.points.size()));
      }
    }
    bench.push(i, view, static_cast<GstClockTime>(frame) * frame_time);
  }
  bench.pull();
}

/// The camera stands where it should: what is told is what it sees.
ELEMENT_TEST(test_background_is_no_camera_that_has_moved) {
  for (const float width : {3.0f, 60.0f})
    for (const bool grown : {false, true}) {
      Bench bench;
      for (int frame = 0; frame < 30; ++frame) push_with_background(bench, frame, width, grown);
      fail_unless(figure(bench.element, "tangency-px") > 20.0);
      const auto warnings = bench.warnings();
      fail_unless_equals_int(warnings.size(), 1);
      expect_in(warnings[0], {"camera cam2 near (", "no other camera sees", "background"});
      fail_unless(warnings[0].find("moved") == std::string::npos, "%s", warnings[0].c_str());
    }
}

/// It sees more than the others, or less, on all sides.
ELEMENT_TEST(test_a_wrong_focal_length_is_no_background) {
  for (const double factor : {0.9, 1.03, 1.1, 1.4}) {
    Bench bench;
    for (int i = 0; i < 2; ++i) bench.rig.cameras[1].K[i][i] *= factor;
    for (int frame = 0; frame < 30; ++frame) push_frame(bench, frame, -1);
    const auto warnings = bench.warnings();
    fail_unless_equals_int(warnings.size(), 1);
    expect_in(warnings[0], {"most likely camera cam1", "calibration"});
  }
}

ELEMENT_TEST(test_a_moment_is_not_worth_a_word) {
  Bench bench;
  for (int frame = 0; frame < 60; ++frame) push_frame(bench, frame, frame == 30 ? 2 : -1);
  fail_unless(bench.warnings().empty());
}

ELEMENT_TEST(test_can_be_left_out) {
  Bench bench("check-cameras=false");
  for (int frame = 0; frame < 50; ++frame) push_frame(bench, frame, 2);
  fail_unless(bench.warnings().empty());
  fail_unless(figure(bench.element, "check-ms") == 0.0);
  g_object_set(bench.element, "check-cameras", TRUE, nullptr);
  for (int frame = 50; frame < 75; ++frame) push_frame(bench, frame, 2);
  fail_unless_equals_int(bench.warnings().size(), 1);
}
