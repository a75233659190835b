// SPDX-License-Identifier: LGPL-2.1-or-later
// hullbuild says where the rig, and not one camera, is wrong: another stage's, another unit, bounds
// elsewhere, no floor. Each is said once.
#include <fstream>

#include "element_test.h"
#include "hull_bench.h"
#include "plugins/common/rig_event.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

std::string write_rig(const std::string& name, const Rig& rig) {
  const std::string path = folder.file(name) + ".json";
  std::ofstream(path) << rig_to_json(rig);
  return path;
}

/// default_rig() with all lengths times \p factor.
Rig scaled_rig(double factor, const std::string& unit) {
  Rig rig = default_rig();
  for (Camera& camera : rig.cameras) camera.t *= factor;
  rig.bounds->min *= factor;
  rig.bounds->max *= factor;
  rig.unit = unit;
  return rig;
}

/// What is said of \p frames frames of \p box that bench.rig sees.
std::vector<std::string> said(Bench& bench, const Box& box, int frames, int begin = 0) {
  for (int frame = begin; frame < begin + frames; ++frame) {
    Box moved = box;
    moved.centre.x += 0.002 * box.half.x * frame;
    for (std::size_t i = 0; i < bench.inputs.size(); ++i)
      bench.push_box(static_cast<int>(i), frame, moved);
    bench.pull();
  }
  return bench.warnings();
}

std::vector<std::string> said_by(const std::string& name, const Rig& rig, const Box& box,
                                 int frames) {
  Bench bench("rig=" + write_rig(name, rig));
  return said(bench, box, frames);
}

void expect_one(const std::vector<std::string>& warnings,
                std::initializer_list<const char*> parts) {
  fail_unless_equals_int(warnings.size(), 1);
  expect_in(warnings[0], parts);
}

}  // namespace

ELEMENT_TEST(test_a_wrong_unit_is_said_once) {
  expect_one(said_by("as_mm", scaled_rig(1.0, "mm"), {}, 40),
             {"0.00172 m high", "unit is mm", "in m, the subject is 1.72 m", "polyhull-rig check"});
  expect_one(said_by("as_cm", scaled_rig(1.0, "cm"), {}, 40), {"0.0172 m high", "\"unit\": \"m\""});
  expect_one(said_by("mm_as_m", scaled_rig(1000.0, "m"), {}, 40), {"\"unit\": \"mm\""});
  expect_one(said_by("cm_as_m", scaled_rig(100.0, "m"), {}, 40),
             {"172 m high", "\"unit\": \"cm\""});
  expect_one(said_by("mm_as_cm", scaled_rig(1000.0, "cm"), {}, 40), {"17.2 m high", "in mm"});
  fail_unless(said_by("right_mm", scaled_rig(1000.0, "mm"), {}, 10).empty());
}

ELEMENT_TEST(test_a_rig_may_be_mended_and_spoiled_while_playing) {
  const std::string wrong = write_rig("wrong", scaled_rig(1.0, "mm"));
  Bench bench;
  fail_unless(said(bench, {}, 10).empty());
  fail_unless(std::abs(figure(bench.element, "subject-height-mm") - 1720.0) < 20.0);
  for (int round = 0; round < 2; ++round) {
    g_object_set(bench.element, "rig", wrong.c_str(), nullptr);
    fail_unless(said(bench, {}, 4, 10 + 40 * round).empty());
    expect_one(said(bench, {}, 20, 14 + 40 * round), {"unit is mm"});
    fail_unless_equals_uint64(bench.count("sets-implausible"), 24 * (round + 1));
    g_object_set(bench.element, "rig", "", nullptr);
    fail_unless(said(bench, {}, 10, 35 + 40 * round).empty());
  }
}

ELEMENT_TEST(test_small_and_large_subjects_are_none_of_a_wrong_unit) {
  const Box ball{{0.0, 1.0, 0.0}, {0.03, 0.03, 0.03}},
      fingertip{{0.2, 1.0, 0.1}, {0.004, 0.004, 0.004}};
  const Box acrobats{{0.0, 1.3, 0.0}, {0.5, 1.2, 0.5}};
  for (const Box& box : {ball, fingertip, acrobats}) {
    Bench bench;
    const auto warnings = said(bench, box, 10);
    fail_unless(warnings.empty(), "%s", warnings[0].c_str());
    fail_unless_equals_uint64(bench.count("sets-implausible"), 0);
  }
  // A table-top, its cameras 30 cm away; a hall, 20 m.
  fail_unless(said_by("table_top", scaled_rig(0.1, "m"), {}, 10).empty());
  fail_unless(said_by("table_top_mm", scaled_rig(100.0, "mm"), {}, 10).empty());
  fail_unless(said_by("hall", scaled_rig(7.0, "m"), ball, 10).empty());
}

ELEMENT_TEST(test_a_wrong_rig_is_said_and_no_camera_is_blamed) {
  const Rig five = load_rig(std::string(g_getenv("POLYHULL_SOURCE")) + "/pipelines/rigs/five.json");
  Bench bench;
  fail_unless(said(bench, {}, 10).empty());
  fail_unless_equals_uint64(bench.count("sets-contradicted"), 0);
  // From here on the cameras stand where another rig has them.
  for (int i = 0; i < 4; ++i) bench.rig.cameras[i] = five.cameras[i];
  const auto warnings = said(bench, {}, 90, 10);
  expect_one(warnings, {"It is the rig, not one camera", "of 4 cameras", "another stage",
                        "polyhull-rig check RIG --pictures"});
  fail_unless(warnings[0].find("most likely camera") == std::string::npos);
  fail_unless(bench.count("sets-contradicted") > 60);
}

ELEMENT_TEST(test_bounds_elsewhere_are_said_with_the_place) {
  Rig rig = default_rig();
  rig.bounds = Bounds{Vec3(1000.0, 0.0, -1200.0), Vec3(2000.0, 2300.0, 1200.0)};
  expect_one(said_by("bounds_mm", rig, {}, 40),
             {"within the rig's bounds", "(-0.258, 0.105, -0.222)", "use-bounds=false"});
}

ELEMENT_TEST(test_one_camera_far_off_with_an_empty_hull_is_one_warning) {
  Bench bench;
  bench.rig.cameras[2].t.y += 2.0;
  expect_one(said(bench, {}, 40), {"the hull is empty", "most likely camera cam2"});
}

ELEMENT_TEST(test_a_rig_without_a_floor_is_said_once) {
  Rig rig = default_rig();
  rig.bounds.reset();
  expect_one(said_by("no_floor", rig, {}, 40), {"look down", "no bounds", "polyhull-rig level"});
  // One that looks up sees the soles.
  Camera& camera = rig.cameras[1];
  camera.R = Mat3(1.0);
  camera.t = Vec3(0.0, 1.0, 3.0);
  camera.R[1][1] = camera.R[2][2] = -1.0;
  Bench bench("rig=" + write_rig("level_camera", rig));
  bench.rig = rig;
  fail_unless(said(bench, {}, 10).empty());
}

ELEMENT_TEST(test_a_distortion_that_no_lens_has_is_said) {
  Rig rig = default_rig();
  rig.cameras[0].distortion = {-0.3, 0.1, 0.001, 0.001, -0.01};
  rig.cameras[1].distortion = {-2.0, 0.0, 0.0, 0.0, 0.0};
  Bench bench("rig=" + write_rig("no_lens", rig));
  expect_one(bench.warnings(), {"no lens's", "of cam1 (", "% of its picture", "Calibrate"});
  bench.rig = rig;
  bench.rig.cameras[1].distortion.clear();
  for (int i = 0; i < 4; ++i) bench.push_box(i, 0);
  const auto mesh = bench.pull();
  fail_unless(!mesh->hull.empty());
  fail_unless(mesh->views[0].calibration.has_distortion());
  fail_unless(!mesh->views[1].calibration.has_distortion());
  fail_unless(bench.warnings().empty());
}

/// Views may bring their rig, as takesrc's do: it stands in for the property, and one rig only.
ELEMENT_TEST(test_views_bring_their_rig) {
  const auto tell = [](Bench& bench, int pad, const std::string& json) {
    gst_harness_push_event(bench.inputs[pad], element::make_rig_event(json));
  };
  const auto first_camera = [](Bench& bench, int frame) {
    for (int i = 0; i < 4; ++i) bench.push_box(i, frame);
    return bench.pull()->views[0].calibration.t;
  };
  Rig rig = default_rig();
  for (Camera& camera : rig.cameras) camera.t.z += 0.25;
  const std::string told = rig_to_json(rig);
  Bench bench;
  for (int i = 0; i < 4; ++i) tell(bench, i, told);
  fail_unless(first_camera(bench, 0) == rig.cameras[0].t);
  fail_unless(bench.warnings().empty());
  // Two at a time are said, once.
  tell(bench, 2, rig_to_json(default_rig()));
  fail_unless(first_camera(bench, 1) == default_rig().cameras[0].t);
  expect_one(bench.warnings(), {"different rigs", "Set rig"});
  tell(bench, 2, told);
  fail_unless(first_camera(bench, 2) == rig.cameras[0].t);
  fail_unless(bench.warnings().empty());
  // The property comes first.
  g_object_set(bench.element, "rig", write_rig("own", scaled_rig(1.0, "m")).c_str(), nullptr);
  fail_unless(first_camera(bench, 3) == default_rig().cameras[0].t);
  g_object_set(bench.element, "rig", "", nullptr);
  fail_unless(first_camera(bench, 4) == rig.cameras[0].t);

  // One that keeps none is said, once, and not where the property names one.
  tell(bench, 1, "");
  fail_unless(first_camera(bench, 5) == rig.cameras[0].t);
  fail_unless(bench.warnings().empty());
  for (const bool named : {false, true}) {
    Bench without(named ? "rig=" + write_rig("own", rig) : "");
    for (int i = 0; i < 4; ++i) tell(without, i, "");
    for (int frame = 0; frame < 3; ++frame) first_camera(without, frame);
    if (named)
      fail_unless(without.warnings().empty());
    else
      expect_one(without.warnings(), {"keeps no rig", "built-in rig", "Set hullbuild's rig"});
  }

  Bench broken;
  tell(broken, 1, "{\"format\": \"polyhull-rig\"}");
  for (int i = 0; i < 4; ++i) broken.push_box(i, 0);
  expect_in(broken.error(), {"rig that came with the views", "version"});
}

/// One take behind another on the same pads (concat), in whatever order the pads come to it, and one
/// that brings no rig; and one in the place of another, on pads of its own.
ELEMENT_TEST(test_another_take_brings_its_own_rig) {
  Bench bench;
  int frame = 0;
  const auto first_camera = [&] {
    for (std::size_t i = 0; i < bench.inputs.size(); ++i)
      bench.push_box(static_cast<int>(i), frame);
    ++frame;
    return bench.pull()->views[0].calibration.t;
  };
  const auto start = [&](const Rig* rig) {
    for (std::size_t i = bench.inputs.size(); i-- > 0;) {
      gst_harness_push_event(bench.inputs[i], gst_event_new_stream_start("another"));
      GstSegment segment;
      gst_segment_init(&segment, GST_FORMAT_TIME);
      gst_harness_push_event(bench.inputs[i], gst_event_new_segment(&segment));
      if (rig) gst_harness_push_event(bench.inputs[i], element::make_rig_event(rig_to_json(*rig)));
    }
  };
  Rig near = default_rig(), far = default_rig();
  for (Camera& camera : near.cameras) camera.t.z -= 0.25;
  for (Camera& camera : far.cameras) camera.t.z += 0.25;
  start(&near);
  fail_unless(first_camera() == near.cameras[0].t);
  start(&far);
  fail_unless(first_camera() == far.cameras[0].t);
  start(nullptr);
  fail_unless(first_camera() == default_rig().cameras[0].t);
  start(&near);
  fail_unless(first_camera() == near.cameras[0].t);
  for (GstHarness*& input : bench.inputs) {
    gst_harness_teardown(input);
    input = gst_harness_new_with_element(bench.element, "sink_%u", nullptr);
    gst_harness_set_live(input, FALSE);
    gst_harness_set_src_caps_str(input, "application/x-polyhull-view");
  }
  fail_unless(first_camera() == default_rig().cameras[0].t);
  fail_unless(bench.warnings().empty());
}
