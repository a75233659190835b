// SPDX-License-Identifier: LGPL-2.1-or-later
// hullbuild where cameras are missing, late or gone: what it builds, drops, holds and says.
#include <gst/check/gstharness.h>
#include <gst/check/gsttestclock.h>

#include "element_test.h"
#include "hull_bench.h"
#include "render/projection.h"
#include "scene/scene.h"

using namespace polyhull;
using namespace polyhull::test;

ELEMENT_TEST(test_missing_views) {
  // Frame 1 lacks camera 3. A queue holds one view, so camera 3 goes on first.
  const auto feed = [](Bench& bench) {
    for (int frame = 0; frame < 3; ++frame)
      for (int i = 3; i >= 0; --i)
        if (frame != 1 || i != 3) bench.push_box(i, frame);
  };
  {
    Bench bench("missing-camera=drop-camera");
    feed(bench);
    fail_unless_equals_int(bench.pull()->views.size(), 4);
    fail_unless_equals_int(bench.pull()->views.size(), 3);
    fail_unless_equals_int(bench.pull()->views.size(), 4);
    fail_unless_equals_uint64(bench.count("sets-incomplete"), 1);
  }
  {
    Bench bench("missing-camera=drop-set");
    feed(bench);
    fail_unless_equals_uint64(bench.pull()->trigger, 0);
    fail_unless_equals_uint64(bench.pull()->trigger, 2);
    fail_unless_equals_uint64(bench.count("sets-dropped-incomplete"), 1);
    fail_unless_equals_int(bench.messages(GST_MESSAGE_QOS), 1);
  }
  {
    Bench bench("missing-camera=hold");
    feed(bench);
    bench.pull();
    const auto mesh = bench.pull();
    fail_unless_equals_int(mesh->views.size(), 4);
    fail_unless_equals_uint64(mesh->views[2].view.trigger, 1);
    fail_unless_equals_uint64(mesh->views[3].view.trigger, 0);
    bench.pull();
    fail_unless_equals_uint64(bench.count("views-held"), 1);
  }
  {
    Bench bench("missing-camera=hold hold-time=0");
    feed(bench);
    bench.pull();
    fail_unless_equals_int(bench.pull()->views.size(), 3);
  }
  {
    Bench bench("missing-camera=drop-camera min-cameras=4");
    feed(bench);
    bench.pull();
    fail_unless_equals_uint64(bench.pull()->trigger, 2);
    fail_unless_equals_uint64(bench.count("sets-dropped-few-cameras"), 1);
    fail_unless_equals_int(bench.messages(GST_MESSAGE_WARNING), 1);
  }
}

ELEMENT_TEST(test_live_sets_wait_no_longer_than_max_wait) {
  Bench bench("max-wait=30000000", 3, true);
  GstTestClock* clock = gst_harness_get_testclock(bench.output);
  bench.push_box(0, 5);
  bench.push_box(1, 5);
  fail_unless(bench.nothing_more());
  // The element waits for the clock to show the views' time, 200 ms, and 30 ms.
  GstClockID id = nullptr;
  gst_test_clock_wait_for_next_pending_id(clock, &id);
  fail_unless_equals_uint64(gst_clock_id_get_time(id), 230 * GST_MSECOND);
  gst_clock_id_unref(id);
  gst_test_clock_set_time(clock, 229 * GST_MSECOND);
  fail_unless(bench.nothing_more());
  gst_test_clock_set_time(clock, 230 * GST_MSECOND);
  GstClockID done = gst_test_clock_process_next_clock_id(clock);
  if (done != nullptr) gst_clock_id_unref(done);
  fail_unless_equals_int(bench.pull()->views.size(), 2);
  // Too late.
  bench.push_box(2, 5);
  for (int i = 0; i < 3; ++i) bench.push_box(i, 6);
  const auto mesh = bench.pull();
  fail_unless_equals_uint64(mesh->trigger, 6);
  fail_unless_equals_int(mesh->views.size(), 3);
  fail_unless_equals_uint64(bench.count("views-late"), 1);
  gst_object_unref(clock);
}

/// A long gap speaks for its camera to its end, also when the deadline of its begin has passed.
ELEMENT_TEST(test_long_gaps_count_in_live_streams) {
  Bench bench("missing-camera=drop-camera max-wait=30000000", 3, true);
  GstTestClock* clock = gst_harness_get_testclock(bench.output);
  gst_harness_push_event(bench.inputs[2], gst_event_new_gap(200 * GST_MSECOND, GST_SECOND));
  GstClockID id = nullptr;
  gst_test_clock_wait_for_next_pending_id(clock, &id);
  fail_unless_equals_uint64(gst_clock_id_get_time(id), 1230 * GST_MSECOND);
  gst_clock_id_unref(id);
  gst_test_clock_set_time(clock, 600 * GST_MSECOND);
  for (int i = 0; i < 2; ++i) bench.push_box(i, 16);  // 640 ms, to wait for until 670 ms at most
  fail_if(bench.nothing_more(), "hullbuild waits for the camera that said it has nothing");
  fail_unless_equals_int(bench.pull()->views.size(), 2);
  gst_object_unref(clock);
}

/// Live, views that are not of the pad's camera are dropped, whatever is wrong with them, and the
/// other cameras' sets go on.
ELEMENT_TEST(test_live_views_of_wrong_cameras_are_dropped) {
  Bench bench("max-wait=30000000", 4, true);
  GstTestClock* clock = gst_harness_get_testclock(bench.output);
  const auto let_pass = [&](GstClockTime time) {
    GstClockID id = nullptr;
    gst_test_clock_wait_for_next_pending_id(clock, &id);
    gst_clock_id_unref(id);
    gst_test_clock_set_time(clock, time);
    GstClockID done = gst_test_clock_process_next_clock_id(clock);
    if (done != nullptr) gst_clock_id_unref(done);
  };
  const auto bad = [&](int frame, const std::string& name, int width) {
    Camera camera = bench.rig.cameras[3];
    camera.name = name;
    camera.width = width;
    std::vector<std::uint8_t> pixels;
    bench.push(3, box_view(camera, {}, frame, pixels), frame * frame_time);
  };
  const auto expect_dropped = [&](guint64 count, std::initializer_list<const char*> words) {
    wait_for_statistic(bench.element, "views-unusable", count);
    std::string all;
    for (const std::string& warning : bench.warnings()) all += warning + "\n";
    if (words.size() > 0) expect_in(all, words);
  };
  for (int i = 0; i < 3; ++i) bench.push_box(i, 5);
  bad(5, "rihgt", 1024);
  expect_dropped(
      1, {"sink_3", "rihgt", "the built-in rig", "does not have", "cam0, cam1, cam2, cam3"});
  let_pass(230 * GST_MSECOND);
  fail_unless_equals_int(bench.pull()->views.size(), 3);
  // The sets are looked at where all cameras have something, or the time is up.
  g_usleep(1'100'000);  // each warning stands for a second
  for (int i = 0; i < 3; ++i) bench.push_box(i, 6);
  bad(6, "cam3", 640);
  expect_dropped(2, {"sink_3", "cam3", "640x768", "1024x768"});
  g_usleep(1'100'000);
  bad(6, "cam0", 1024);
  expect_dropped(3, {"sink_3", "sink_0", "both bring views of camera 'cam0'"});
  bad(6, "", 1024);
  expect_dropped(4, {});
  bench.push_box(3, 6);
  const auto mesh = bench.pull();
  fail_unless_equals_int(mesh->views.size(), 4);
  fail_unless(mesh->views[0].view.trigger == 6 && mesh->views[3].view.camera == "cam3");
  fail_unless_equals_uint64(bench.count("unusable-views-cam3"), 4);
  // A camera that another pad has brought is that one's, also where its view is missing.
  for (int i = 1; i < 3; ++i) bench.push_box(i, 7);
  bad(7, "cam0", 1024);
  let_pass(400 * GST_MSECOND);
  fail_unless_equals_int(bench.pull()->views.size(), 2);
  fail_unless_equals_uint64(bench.count("views-unusable"), 5);
  // Who has been silent for a second may be stood in for.
  gst_test_clock_set_time(clock, 1300 * GST_MSECOND);
  for (int i = 1; i < 3; ++i) bench.push_box(i, 33);
  bad(33, "cam0", 1024);
  let_pass(1400 * GST_MSECOND);
  fail_unless_equals_int(bench.pull()->views.size(), 3);
  fail_unless_equals_uint64(bench.count("views-unusable"), 5);
  gst_object_unref(clock);
}

/// Silhouettes that meet nowhere: a rig that is not this stage's, or swapped cameras. Said once.
ELEMENT_TEST(test_silhouettes_without_a_common_point_are_said) {
  Bench bench;
  Box elsewhere;
  elsewhere.centre.x = 1.2;
  for (int frame = 0; frame < 8; ++frame) {
    for (int i = 0; i < 4; ++i) bench.push_box(i, frame, i < 2 ? Box{} : elsewhere);
    fail_unless(bench.pull()->hull.empty());
  }
  const std::vector<std::string> warnings = bench.warnings();
  fail_unless_equals_int(warnings.size(), 1);
  expect_in(warnings[0], {"All 4 cameras", "no point of space in common", "swapped", "unit"});
}

/// One empty hull may be a subject that has just left: five in a row are said, once.
ELEMENT_TEST(test_few_empty_hulls_are_not_said) {
  Bench bench;
  Box elsewhere;
  elsewhere.centre.x = 1.2;
  int frame = 0;
  const auto push = [&](bool apart) {
    for (int i = 0; i < 4; ++i) bench.push_box(i, frame, apart && i >= 2 ? elsewhere : Box{});
    ++frame;
    return bench.pull()->hull.empty();
  };
  for (int round = 0; round < 2; ++round) {
    fail_if(push(false));
    for (int i = 0; i < 4; ++i) fail_unless(push(true));
    fail_unless_equals_int(bench.warnings().size(), 0);
  }
  fail_unless(push(true));
  fail_unless_equals_int(bench.warnings().size(), 1);
}

/// A set that lacks cameras is dropped for hold-time, then built; that is said once, by name.
ELEMENT_TEST(test_freeze_drops_for_a_moment_and_then_builds) {
  Bench bench("missing-camera=freeze hold-time=80000000", 4);
  for (int i = 0; i < 4; ++i) bench.push_box(i, 0);
  fail_unless_equals_int(bench.pull()->views.size(), 4);
  gst_harness_push_event(bench.inputs[3], gst_event_new_gap(frame_time, 20 * frame_time));
  for (int frame = 1; frame <= 6; ++frame)
    for (int i = 0; i < 3; ++i) bench.push_box(i, frame);
  // The last whole set is 40 and 80 ms old with the first two.
  fail_unless_equals_uint64(bench.pull()->trigger, 3);
  for (int frame = 4; frame <= 6; ++frame) {
    const auto mesh = bench.pull();
    fail_unless_equals_uint64(mesh->trigger, frame);
    fail_unless_equals_int(mesh->views.size(), 3);
  }
  fail_unless_equals_uint64(bench.count("sets-dropped-incomplete"), 2);
  fail_unless_equals_uint64(bench.count("sets-incomplete"), 4);
  const std::vector<std::string> warnings = bench.warnings();
  fail_unless_equals_int(warnings.size(), 1);
  expect_in(warnings[0], {"from 3 cameras, without cam3", "missing-camera"});
}

/// A hold-time that is shorter than a frame holds one all the same: at 24/s the default is.
ELEMENT_TEST(test_a_lost_frame_is_held_at_any_rate) {
  for (const char* mode : {"freeze", "hold"}) {
    Bench bench(std::string("hold-time=30000000 missing-camera=") + mode);
    for (int i = 3; i >= 0; --i) bench.push_box(i, 0);
    fail_unless_equals_int(bench.pull()->views.size(), 4);
    bench.push_box(3, 3);
    for (int frame = 1; frame <= 3; ++frame)
      for (int i = 0; i < 3; ++i) bench.push_box(i, frame);
    if (*mode == 'h') fail_unless_equals_int(bench.pull()->views.size(), 4);
    const auto second = bench.pull();
    fail_unless(second->views.size() == 3 && second->trigger == 2);
    fail_unless_equals_int(bench.pull()->views.size(), 4);
  }
}

/// What will not come again is not waited for.
ELEMENT_TEST(test_freeze_does_not_wait_for_who_has_ended) {
  Bench bench("missing-camera=freeze hold-time=80000000", 4);
  for (int i = 0; i < 4; ++i) bench.push_box(i, 0);
  fail_unless_equals_int(bench.pull()->views.size(), 4);
  gst_harness_push_event(bench.inputs[3], gst_event_new_eos());
  for (int i = 0; i < 3; ++i) bench.push_box(i, 1);
  const auto mesh = bench.pull();
  fail_unless_equals_uint64(mesh->trigger, 1);
  fail_unless_equals_int(mesh->views.size(), 3);
  fail_unless_equals_uint64(bench.count("sets-dropped-incomplete"), 0);
}

/// Who sends, but too late, is waited for ten times as long as who is silent.
ELEMENT_TEST(test_freeze_waits_longer_for_who_sends_late) {
  for (const bool sends : {true, false}) {
    Bench bench("missing-camera=freeze hold-time=80000000 max-wait=30000000", 3, true);
    GstTestClock* clock = gst_harness_get_testclock(bench.output);
    for (int i = 0; i < 3; ++i) bench.push_box(i, 0);
    fail_unless_equals_int(bench.pull()->views.size(), 3);
    for (int frame = 1; frame <= 5; ++frame) {
      for (int i = 0; i < 2; ++i) bench.push_box(i, frame);
      gst_test_clock_set_time(clock, frame * frame_time + 30 * GST_MSECOND);
      const auto decided = [&] {
        return bench.count("sets") + bench.count("sets-dropped-incomplete") +
               bench.count("sets-unwanted");
      };
      for (int waited = 0; decided() <= static_cast<guint64>(frame) && waited < 400; ++waited) {
        if (GstClockID done = gst_test_clock_process_next_clock_id(clock)) gst_clock_id_unref(done);
        g_usleep(5000);
      }
      if (sends) bench.push_box(2, frame);
    }
    fail_unless((bench.count("sets-incomplete") == 0) == sends, "%d sets built without a camera",
                static_cast<int>(bench.count("sets-incomplete")));
    if (sends) fail_unless(bench.count("views-late") > 3);
    gst_object_unref(clock);
  }
}

ELEMENT_TEST(test_fewer_than_three_of_many_are_no_set) {
  Bench bench("min-cameras=0", 4);
  for (int i = 0; i < 2; ++i) gst_harness_push_event(bench.inputs[i], gst_event_new_eos());
  for (int i = 2; i < 4; ++i) bench.push_box(i, 0);
  for (int i = 2; i < 4; ++i) gst_harness_push_event(bench.inputs[i], gst_event_new_eos());
  fail_unless(bench.nothing_more());
  fail_unless_equals_uint64(bench.count("sets-dropped-few-cameras"), 1);
  Bench two("min-cameras=0", 2);
  for (int i = 0; i < 2; ++i) two.push_box(i, 0);
  fail_unless_equals_int(two.pull()->views.size(), 2);
}

/// Where too few cameras are left, the last set stands still for half a second, fades out over .3 s, and
/// in again with the sets once the cameras are back.
ELEMENT_TEST(test_a_subject_of_too_few_cameras_fades) {
  Bench bench("missing-camera=freeze min-cameras=0 hold-time=80000000", 4);
  const auto push = [&](int frame, std::initializer_list<int> cameras) {
    for (const int i : cameras) bench.push_box(i, frame);
  };
  push(0, {0, 1, 2, 3});
  const Hull whole = bench.pull()->hull;
  constexpr int still = 12, gone = 24;  // frames
  for (const int i : {1, 2})
    gst_harness_push_event(bench.inputs[i], gst_event_new_gap(frame_time, gone * frame_time));
  for (int frame = 1; frame <= gone; ++frame) push(frame, {0, 3});
  for (int step = 1; step <= 8; ++step) {
    const auto mesh = bench.pull();
    fail_unless(std::abs(mesh->opacity - std::max(1.0 - step * 40.0 / 300.0, 0.0)) < 1e-5,
                "%g at step %d", static_cast<double>(mesh->opacity), step);
    fail_unless_equals_uint64(GST_BUFFER_PTS(bench.last.get()), (still + step) * frame_time);
    fail_unless_equals_uint64(mesh->trigger, no_trigger);
    fail_unless_equals_int(mesh->views.size(), 4);
    fail_unless(mesh->hull.vertices == whole.vertices);
  }
  fail_unless(bench.nothing_more());
  fail_unless_equals_uint64(bench.count("sets-dropped-incomplete"), 2);
  fail_unless_equals_uint64(bench.count("sets-dropped-few-cameras"), gone - 2);
  for (int step = 1; step <= 9; ++step) {
    push(gone + step, {0, 1, 2, 3});
    const auto mesh = bench.pull();
    fail_unless(std::abs(mesh->opacity - std::min(step * 40.0 / 300.0, 1.0)) < 1e-5);
    fail_unless_equals_uint64(mesh->trigger, gone + step);
  }
  fail_unless_equals_uint64(bench.count("sets-fading"), 15);
  const std::vector<std::string> warnings = bench.warnings();
  fail_unless_equals_int(warnings.size(), 1);
  expect_in(warnings[0], {"hidden", "cam1", "cam2", "2 views, 3 are asked for", "min-cameras"});
}

/// A flush of one camera, or another rig, does not leave the subject standing, nor bring it back at once.
ELEMENT_TEST(test_a_subject_that_fades_is_not_forgotten) {
  const std::string file = folder.file("same.json");
  std::ofstream(file) << rig_to_json(default_rig());
  for (const bool flush : {true, false}) {
    Bench bench("min-cameras=0");
    const auto opacity_of = [&](int frame, int cameras) {
      for (int i = 0; i < cameras; ++i) bench.push_box(i, frame);
      return bench.pull()->opacity;
    };
    const auto miss = [&](int input, int frame) {
      gst_harness_push_event(bench.inputs[input],
                             gst_event_new_gap(frame * frame_time, (30 - frame) * frame_time));
    };
    fail_unless(opacity_of(0, 4) == 1.0f);
    for (const int i : {2, 3}) miss(i, 1);
    for (int frame = 1; frame < 13; ++frame)
      for (int i = 0; i < 2; ++i) bench.push_box(i, frame);
    fail_unless(opacity_of(13, 2) < 1.0f);
    if (flush) {
      gst_harness_push_event(bench.inputs[3], gst_event_new_flush_start());
      gst_harness_push_event(bench.inputs[3], gst_event_new_flush_stop(TRUE));
      GstSegment segment;
      gst_segment_init(&segment, GST_FORMAT_TIME);
      gst_harness_push_event(bench.inputs[3], gst_event_new_segment(&segment));
      miss(3, 14);
      for (int frame = 14; frame < 20; ++frame) {
        const float opacity = opacity_of(frame, 2);
        fail_unless(opacity > 0.0f && opacity < 1.0f);
      }
    } else {
      g_object_set(bench.element, "rig", file.c_str(), nullptr);
    }
    // With another rig the last picture cannot be made any more, so that it goes at once.
    const int gone = flush ? 20 : 14;
    fail_unless(opacity_of(gone, 2) == 0.0f);
    for (int i = 0; i < 2; ++i) bench.push_box(i, gone + 1);
    fail_unless(bench.nothing_more());
    for (int frame = 22; frame < 30; ++frame)
      for (int i = 0; i < 2; ++i) bench.push_box(i, frame);
    fail_unless(std::abs(opacity_of(30, 4) - 40.0f / 300.0f) < 1e-5f);
  }
}

/// What fades is built as what is shown: as coarse, and nothing odd in it ends the stream.
ELEMENT_TEST(test_what_fades_is_built_like_the_rest) {
  Rig wide = default_rig();
  for (Camera& camera : wide.cameras) camera.K[0][0] = camera.K[1][1] = 1.0;
  const std::string file = folder.file("wide_fade.json");
  std::ofstream(file) << rig_to_json(wide);
  Bench bench("adaptive=true surface=none min-cameras=0 rig=" + file);
  bench.rig = wide;
  std::vector<std::uint8_t> pixels;
  View odd = box_view(wide.cameras[0], {}, 0, pixels);
  odd.contours.points[0].x = 9e5f;
  bench.push(0, odd, 0);
  for (int i = 1; i < 4; ++i) bench.push_box(i, 0);
  fail_unless(bench.pull()->opacity == 1.0f);
  for (int i = 1; i <= 20; ++i)
    gst_harness_push_upstream_event(
        bench.output, gst_event_new_qos(GST_QOS_TYPE_OVERFLOW, 3.0, 0, i * 200 * GST_MSECOND));
  for (const int i : {2, 3}) gst_harness_push_event(bench.inputs[i], gst_event_new_eos());
  const auto push = [&](int frame) {
    for (int i = 0; i < 2; ++i) bench.push_box(i, frame);
  };
  push(12);
  push(13);
  fail_unless(bench.pull()->opacity < 1.0f);
  double coarser = 0.0;
  GstStructure* stats = nullptr;
  g_object_get(bench.element, "stats", &stats, nullptr);
  gst_structure_get_double(stats, "coarser-px", &coarser);
  gst_structure_free(stats);
  fail_unless(coarser > 0.0);
  g_object_set(bench.element, "adaptive", FALSE, nullptr);
  gst_util_set_object_arg(G_OBJECT(bench.element), "surface", "polyhedral");
  push(14);
  fail_unless(bench.nothing_more());
  fail_unless_equals_uint64(bench.count("sets-refused"), 1);
  fail_unless_equals_int(bench.messages(GST_MESSAGE_ERROR), 0);
}

/// A fade that the streams' end cuts short, or the silence of all cameras, leaves nothing translucent.
ELEMENT_TEST(test_a_fade_is_never_left_half_way) {
  for (const bool live : {false, true}) {
    for (const bool in : {false, true}) {
      Bench bench(live ? "min-cameras=0 max-wait=30000000" : "min-cameras=0", 4, live);
      const auto push = [&](int frame, int cameras) {
        for (int i = 0; i < cameras; ++i) bench.push_box(i, frame);
      };
      push(0, 4);
      bench.pull();
      for (const int i : {2, 3})
        gst_harness_push_event(bench.inputs[i], gst_event_new_gap(frame_time, 13 * frame_time));
      push(10, 2);
      push(13, 2);
      float opacity = bench.pull()->opacity;
      if (in) {
        push(14, 4);
        push(15, 4);
        bench.pull();
        opacity = bench.pull()->opacity;
      }
      fail_unless(opacity > 0.0f && opacity < 1.0f);
      fail_unless(bench.nothing_more());
      if (live) {
        GstTestClock* clock = gst_harness_get_testclock(bench.output);
        while (bench.nothing_more()) {  // at the end of the gaps, and of what may stand still
          GstClockID id = nullptr;
          gst_test_clock_wait_for_next_pending_id(clock, &id);
          gst_test_clock_set_time(clock, gst_clock_id_get_time(id));
          gst_clock_id_unref(id);
          id = gst_test_clock_process_next_clock_id(clock);
          if (id != nullptr) gst_clock_id_unref(id);
        }
        gst_object_unref(clock);
      } else {
        for (GstHarness* input : bench.inputs) gst_harness_push_event(input, gst_event_new_eos());
      }
      fail_unless(bench.pull()->opacity == (in ? 1.0f : 0.0f));
      fail_unless_equals_uint64(GST_BUFFER_PTS(bench.last.get()), (in ? 16 : 14) * frame_time);
      fail_unless(bench.nothing_more());
    }
  }
}

/// Three cameras in a row do not bound anybody, whether the two beside it are lost at once or one by one.
ELEMENT_TEST(test_a_subject_without_bounds_fades) {
  Rig rig = default_rig();
  rig.cameras.clear();
  for (const double degrees : {0.0, 15.0, 180.0, 45.0, 90.0}) {
    const double angle = glm::radians(degrees);
    rig.cameras.push_back(look_at({3.0 * std::sin(angle), 1.4, 3.0 * std::cos(angle)},
                                  {0.0, 0.95, 0.0}, 58.0, 1024, 768));
    rig.cameras.back().name = "cam" + std::to_string(rig.cameras.size() - 1);
  }
  const std::string file = folder.file("row.json");
  std::ofstream(file) << rig_to_json(rig);
  for (const bool at_once : {true, false}) {
    Bench bench("missing-camera=drop-camera min-cameras=0 rig=" + file, 5);
    bench.rig = rig;
    int frame = 0;
    const auto show = [&](int cameras) {
      for (int i = 0; i < cameras; ++i) bench.push_box(i, frame);
      frame += 15;
      return bench.pull();
    };
    fail_unless_equals_int(show(5)->views.size(), 5);
    gst_harness_push_event(bench.inputs[4], gst_event_new_eos());
    if (!at_once) {
      const auto mesh = show(4);
      fail_unless(mesh->views.size() == 4 && mesh->opacity == 1.0f);
    }
    gst_harness_push_event(bench.inputs[3], gst_event_new_eos());
    fail_unless(show(3)->opacity < 1.0f);
    const std::vector<std::string> warnings = bench.warnings();
    fail_if(warnings.empty());
    expect_in(warnings.back(), {"hidden", "cam4", "times as large", "min-cameras"});
  }
}

/// Cameras that lose frames in turn: what one cuts away is not lost anew with each.
ELEMENT_TEST(test_growth_is_that_beyond_all_cameras) {
  Bench bench("min-cameras=0");
  for (int i = 0; i < 4; ++i) bench.push_box(i, 0);
  bench.pull();
  constexpr int frames = 16;
  for (int frame = 1; frame <= frames; ++frame) {
    for (int i = 0; i < 4; ++i) {
      if (i == frame % 4)
        gst_harness_push_event(bench.inputs[i], gst_event_new_gap(frame * frame_time, frame_time));
      else
        bench.push_box(i, frame);
    }
    const auto mesh = bench.pull();
    fail_unless(mesh->views.size() == 3 && mesh->trigger == static_cast<std::uint64_t>(frame));
  }
  fail_unless_equals_uint64(bench.count("sets-dropped-few-cameras"), 0);
}

/// What is connected is all there is: cameras that are taken away do not hide the subject.
ELEMENT_TEST(test_released_cameras_are_not_missed) {
  Bench bench("min-cameras=0");
  for (int i = 0; i < 4; ++i) bench.push_box(i, 0);
  fail_unless_equals_int(bench.pull()->views.size(), 4);
  for (int left = 3; left >= 1; --left) {
    gst_harness_teardown(bench.inputs.back());
    bench.inputs.pop_back();
    for (int i = 0; i < left; ++i) bench.push_box(i, 4 - left);
    fail_unless_equals_int(bench.pull()->views.size(), left);
  }
  fail_unless_equals_uint64(bench.count("sets-dropped-few-cameras"), 0);
}

ELEMENT_TEST(test_views_are_held_for_hold_time) {
  Bench bench("missing-camera=hold hold-time=100000000", 4);
  // Camera 3 leaves frames 1 to 4 out. A queue holds one view, so its next one goes first.
  for (int i = 3; i >= 0; --i) bench.push_box(i, 0);
  fail_unless_equals_int(bench.pull()->views.size(), 4);
  bench.push_box(3, 5);
  for (int frame = 1; frame <= 5; ++frame) {
    for (int i = 0; i < 3; ++i) bench.push_box(i, frame);
    const bool held = frame * 40 <= 100 || frame == 5;
    fail_unless_equals_int(bench.pull()->views.size(), held ? 4 : 3);
  }
  fail_unless_equals_uint64(bench.count("views-held"), 2);
}

/// A rig whose camera has another size has no use for the pictures of before.
ELEMENT_TEST(test_views_of_another_size_are_not_held) {
  Bench bench("missing-camera=hold hold-time=1000000000", 4);
  for (int i = 3; i >= 0; --i) bench.push_box(i, 0);
  fail_unless_equals_int(bench.pull()->views.size(), 4);
  Rig rig = default_rig();
  rig.cameras[3] = resized(rig.cameras[3], 512, 384);
  const std::string path = folder.file("smaller.json");
  std::ofstream(path) << rig_to_json(rig);
  g_object_set(bench.element, "rig", path.c_str(), nullptr);
  gst_harness_push_event(bench.inputs[3], gst_event_new_gap(frame_time, 20 * frame_time));
  for (int i = 0; i < 3; ++i) bench.push_box(i, 1);
  fail_unless_equals_int(bench.pull()->views.size(), 3);
  fail_unless_equals_uint64(bench.count("views-held"), 0);
}
