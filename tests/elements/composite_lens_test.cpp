// SPDX-License-Identifier: LGPL-2.1-or-later
// composite through the viewport's lens: distortion as it is announced or set, depth of field, motion
// blur, fall-off and grain.
#include "composite_bench.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "base/srgb.h"
#include "element_test.h"
#include "scene/announcement.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

using Pixels = std::vector<std::uint8_t>;

Pixels pixels_of(GstBuffer* buffer) {
  GstVideoInfo info;
  gst_video_info_set_format(&info, GST_VIDEO_FORMAT_RGBA, width, height);
  GstVideoFrame video;
  fail_unless(gst_video_frame_map(&video, &info, buffer, GST_MAP_READ));
  Pixels out(4 * width * height);
  for (int y = 0; y < height; ++y)
    std::memcpy(&out[static_cast<std::size_t>(4 * width * y)],
                static_cast<const std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&video, 0)) +
                    static_cast<std::ptrdiff_t>(y) * GST_VIDEO_FRAME_PLANE_STRIDE(&video, 0),
                4 * width);
  gst_video_frame_unmap(&video);
  gst_buffer_unref(buffer);
  return out;
}

/// The frame \p i with the subject, as \p bench is set.
Pixels shown(Bench& bench, int i) {
  gst_harness_push(bench.mesh, mesh_buffer(frame_time(i)));
  return pixels_of(bench.step(opaque_frame(frame_time(i), 16), mesh_buffer(frame_time(i + 1))));
}

struct Box {
  double left = 1e9, top = 1e9, right = -1e9, bottom = -1e9;
  void add(double x, double y) {
    left = std::min(left, x), right = std::max(right, x);
    top = std::min(top, y), bottom = std::max(bottom, y);
  }
  double apart(const Box& other) const {
    return std::max({std::abs(left - other.left), std::abs(top - other.top),
                     std::abs(right - other.right), std::abs(bottom - other.bottom)});
  }
};

/// Around the pixels that differ well from the background's. Borders are a pixel or so wide; how exactly
/// they lie is tests/lib/lens/distorted_view_test.cpp's.
Box box_of(const Pixels& pixels) {
  Box box;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (std::abs(pixels[static_cast<std::size_t>(4 * (width * y + x) + 1)] - grey) > 25)
        box.add(x, y);
  return box;
}

Box box_of_subject(const Camera& camera) {
  Box box;
  const Hull& hull = subject().mesh.hull;
  for (const Vec3f& v : hull.vertices) {
    const Vec2 pixel = camera.project(Vec3(v) + hull.origin).value();
    box.add(pixel.x, pixel.y);
  }
  return box;
}

Camera bench_camera() {
  Camera camera = look_at({0, 1.2, 4}, {1.4, 0.7, 0}, 52.0, width, height);
  camera.distortion = {-0.35, 0.1, 0.01, 0.02, 0.0};
  return camera;
}

/// Looks past the subject, so that it stands where the lens bends most.
struct LensBench : Bench {
  LensBench() {
    wait_for_all();
    g_object_set(element, "target-x", 1.4, "target-y", 0.7, nullptr);
  }
};

void set_distortion(GstElement* element, const std::vector<double>& k) {
  g_object_set(element, "distortion-k1", k[0], "distortion-k2", k[1], "distortion-p1", k[2],
               "distortion-p2", k[3], "distortion-k3", k[4], nullptr);
}

guint64 count_of(GstElement* element, const char* name) {
  GstStructure* stats = nullptr;
  g_object_get(element, "stats", &stats, nullptr);
  guint64 value = 0;
  fail_unless(gst_structure_get_uint64(stats, name, &value), "%s", name);
  gst_structure_free(stats);
  return value;
}

void check_distorted(const Pixels& pixels) {
  const Camera camera = bench_camera();
  Camera pinhole = camera;
  pinhole.distortion.clear();
  const Box truth = box_of_subject(camera), found = box_of(pixels);
  fail_unless(truth.apart(box_of_subject(pinhole)) > 6.0, "the lens does nothing here");
  fail_unless(truth.apart(found) < 2.2, "%.2f px apart: (%g %g %g %g), not (%g %g %g %g)",
              truth.apart(found), found.left, found.top, found.right, found.bottom, truth.left,
              truth.top, truth.right, truth.bottom);
}

}  // namespace

ELEMENT_TEST(test_set_lens_distorts) {
  LensBench bench;
  const Pixels plain = shown(bench, 0);
  fail_unless(count_of(bench.element, "through-lens") == 0);
  set_distortion(bench.element, bench_camera().distortion);  // while playing
  check_distorted(shown(bench, 1));
  fail_unless(count_of(bench.element, "through-lens") == 1);
  set_distortion(bench.element, {0, 0, 0, 0, 0});
  fail_unless(shown(bench, 2) == plain, "the lens left something behind");
  fail_unless(count_of(bench.element, "through-lens") == 1);
}

/// With a lens, too, a viewport that is none for a moment leaves the last one.
ELEMENT_TEST(test_impossible_viewport_leaves_the_last_one) {
  LensBench bench;
  set_distortion(bench.element, bench_camera().distortion);
  const Pixels before = shown(bench, 0);
  g_object_set(bench.element, "eye", "1.4,0.7,0", nullptr);  // the target
  for (int i = 1; i < 3; ++i) fail_unless(shown(bench, i) == before, "frame %d", i);
  fail_unless(count_of(bench.element, "viewports-unusable") == 2);
}

/// A distortion that no lens has is said, once, and the stream goes on: what it has no place for stays
/// the background's.
ELEMENT_TEST(test_no_lens_is_said) {
  LensBench bench;
  const Pixels plain = shown(bench, 0);
  int frame = 0;
  for (const std::vector<double>& k :
       {std::vector<double>{-10, 0, 0, 0, 0}, {-10, 10, 10, -10, -10}, {0, 0, 10, 10, 0}}) {
    set_distortion(bench.element, k);
    shown(bench, ++frame);
    fail_unless_equals_uint64(count_of(bench.element, "viewports-unusable"), 1);
  }
  set_distortion(bench.element, {0, 0, 0, 0, 0});
  fail_unless(shown(bench, ++frame) == plain);
  set_distortion(bench.element, bench_camera().distortion);
  check_distorted(shown(bench, ++frame));
  fail_unless_equals_uint64(count_of(bench.element, "viewports-unusable"), 1);
}

void announce(Bench& bench, const Announcement& announcement) {
  gst_harness_push_event(bench.background, announcement_event(announcement_to_json(announcement)));
}

ELEMENT_TEST(test_announced_lens_distorts) {
  LensBench bench;
  Announcement announcement;
  announcement.viewport = bench_camera();
  announce(bench, announcement);
  check_distorted(shown(bench, 0));
}

ELEMENT_TEST(test_video_output_through_the_lens) {
  LensBench bench;
  set_distortion(bench.element, bench_camera().distortion);
  gst_harness_set_sink_caps_str(bench.background, "video/x-raw,format=I420");
  gst_harness_push(bench.mesh, mesh_buffer(frame_time(0)));
  GstBuffer* picture = bench.step(frame(frame_time(0)), mesh_buffer(frame_time(1)));
  GstMapInfo map;
  fail_unless(gst_buffer_map(picture, &map, GST_MAP_READ));
  // The subject's luma is not the background's.
  const std::uint8_t background = map.data[0];
  Box box;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (std::abs(map.data[width * y + x] - background) > 8) box.add(x, y);
  gst_buffer_unmap(picture, &map);
  gst_buffer_unref(picture);
  fail_unless(box.apart(box_of_subject(bench_camera())) < 2.5, "(%g %g %g %g)", box.left, box.top,
              box.right, box.bottom);
}

/// How many pixels differ.
int changed(const Pixels& a, const Pixels& b) {
  int count = 0;
  for (std::size_t i = 0; i < a.size(); i += 4) count += std::memcmp(&a[i], &b[i], 4) != 0;
  return count;
}

/// How many are not the background's.
int touched(const Pixels& pixels) {
  Pixels background(pixels.size(), std::uint8_t{grey});
  for (std::size_t i = 3; i < background.size(); i += 4) background[i] = 255;
  return changed(pixels, background);
}

// Out of focus the subject is wider than in focus, by its disk on both sides; where the lens is
// tracked, by that lens.
ELEMENT_TEST(test_depth_of_field) {
  LensBench bench;
  const Pixels plain = shown(bench, 0);
  g_object_set(bench.element, "aperture", 100.0, "focus-distance", 4.0, nullptr);
  fail_unless(shown(bench, 1) == plain, "off is not off");
  gst_util_set_object_arg(G_OBJECT(bench.element), "depth-of-field", "picture");
  const Box focused = box_of(shown(bench, 2)), sharp = box_of(plain);
  fail_unless(focused.apart(sharp) <= 1.0, "%g", focused.apart(sharp));
  // 1 / 1.5 m - 1 / 4 m times 50 mm times 185 px are 3.8 px.
  g_object_set(bench.element, "focus-distance", 1.5, nullptr);
  const Pixels near = shown(bench, 3);
  const int before = touched(plain), after = touched(near);
  // The figure is 35 px wide and 100 px high.
  fail_unless(after > before + 300 && after < before + 2400, "%d, then %d", before, after);
  fail_unless(changed(near, plain) > 500);
  // Nothing is announced.
  g_object_set(bench.element, "aperture", 0.0, nullptr);
  fail_unless(shown(bench, 4) == plain, "there is no lens");
}

ELEMENT_TEST(test_depth_of_field_of_a_tracked_lens) {
  const auto frame_with = [](double aperture, double set) {
    LensBench bench;
    gst_util_set_object_arg(G_OBJECT(bench.element), "depth-of-field", "subject");
    g_object_set(bench.element, "aperture", set, "focus-distance", set > 0.0 ? 1.5 : 0.0, nullptr);
    Announcement announcement;
    announcement.viewport = bench_camera();
    announcement.aperture = aperture;
    announcement.focus_distance = aperture > 0.0 ? 1.5 : 0.0;
    announce(bench, announcement);
    return shown(bench, 0);
  };
  const Pixels none = frame_with(0.0, 0.0), tracked = frame_with(0.05, 0.0);
  fail_unless(changed(none, tracked) > 300, "%d", changed(none, tracked));
  fail_unless(tracked == frame_with(0.0, 50.0), "the same lens, set");
}

// A frame is drawn in two parts where the lens blurs, but made ready and counted once.
ELEMENT_TEST(test_blur_makes_ready_and_counts_once) {
  constexpr const char* counts[] = {"drawn",           "pictures-uploaded", "mesh-reused",
                                    "subject-skipped", "shadow-skipped",    "mirror-skipped"};
  for (const char* backend : {"processor", "gl"}) {
    const auto counted = [&](const char* range) {
      Bench bench;
      bench.wait_for_all();
      gst_util_set_object_arg(G_OBJECT(bench.element), "backend", backend);
      gst_util_set_object_arg(G_OBJECT(bench.element), "depth-of-field", range);
      g_object_set(bench.element, "scene", "builtin:room", "eye-z", 2.7, "aperture", 50.0, nullptr);
      // One mesh for all frames.
      GstBuffer* mesh = mesh_buffer(frame_time(0));
      GST_BUFFER_DURATION(mesh) = 40 * 4 * GST_MSECOND;
      gst_harness_push(bench.mesh, mesh);
      for (int i = 0; i < 4; ++i)
        gst_buffer_unref(
            bench.step(opaque_frame(frame_time(i)), i == 0 ? mesh_buffer(frame_time(4)) : nullptr));
      std::vector<guint64> found;
      for (const char* name : counts) found.push_back(count_of(bench.element, name));
      return found;
    };
    const std::vector<guint64> sharp = counted("off"), blurred = counted("picture");
    fail_unless_equals_uint64(sharp[0], 4);
    fail_unless(sharp[1] > 0);
    fail_unless_equals_uint64(sharp[2], 3);
    fail_unless_equals_uint64(sharp[5], 0);
    for (std::size_t i = 0; i < std::size(counts); ++i)
      fail_unless(blurred[i] == sharp[i], "%s, %s: %" G_GUINT64_FORMAT ", not %" G_GUINT64_FORMAT,
                  backend, counts[i], blurred[i], sharp[i]);
  }
}

/// Looks past the subject by a degree and a half more with each frame: 5 pixels.
void turn(Bench& bench, int i) {
  g_object_set(bench.element, "target-x", 1.4 + 0.11 * i, nullptr);
}

// The viewport's motion blurs, standing still and off are as ever, to the bit, on both backends.
ELEMENT_TEST(test_motion_blur) {
  for (const char* backend : {"processor", "gl"}) {
    const auto frames = [backend](const char* range, double angle) {
      LensBench bench;
      gst_util_set_object_arg(G_OBJECT(bench.element), "backend", backend);
      gst_util_set_object_arg(G_OBJECT(bench.element), "motion-blur", range);
      g_object_set(bench.element, "shutter-angle", angle, nullptr);
      std::vector<Pixels> out;
      for (int i = 0; i < 3; ++i) {
        turn(bench, std::min(i, 1));  // the last stands still
        out.push_back(shown(bench, i));
      }
      fail_unless(count_of(bench.element, "motion-blurred") == (out[1] == out[2] ? 0 : 1));
      return out;
    };
    const std::vector<Pixels> sharp = frames("off", 180.0), blurred = frames("subject", 180.0);
    fail_unless(sharp[1] == sharp[2]);
    fail_unless(blurred[0] == sharp[0], "there is no frame before the first");
    fail_unless(blurred[2] == sharp[2], "what stands still is blurred");
    fail_unless(frames("subject", 0.0)[1] == sharp[1], "the shutter is closed");
    // The outline is wider by what moves while the shutter is open, by half of it on either side.
    const int still = touched(sharp[1]), half = touched(blurred[1]),
              whole = touched(frames("subject", 360.0)[1]);
    fail_unless(half > still + 150 && half < still + 600, "%d, still %d", half, still);
    fail_unless(whole > half + 150 && whole < half + 600, "%d, open for half %d", whole, half);
  }
}

// What moves through a picture with distortion moves as without, and stays where it is on the whole.
ELEMENT_TEST(test_motion_blur_through_distortion) {
  const auto second = [](const char* range, bool first = true) {
    LensBench bench;
    set_distortion(bench.element, bench_camera().distortion);
    gst_util_set_object_arg(G_OBJECT(bench.element), "motion-blur", range);
    g_object_set(bench.element, "shutter-angle", 360.0, nullptr);
    turn(bench, 0);
    if (first) shown(bench, 0);
    turn(bench, 1);
    return shown(bench, 1);
  };
  const auto middle = [](const Pixels& pixels) {
    double sum = 0.0, places = 0.0;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        // Light is what adds up.
        const double off =
            std::abs(srgb_to_linear(pixels[static_cast<std::size_t>(4 * (width * y + x))]) -
                     srgb_to_linear(grey));
        sum += off;
        places += off * x;
      }
    return places / sum;
  };
  const Pixels sharp = second("off"), blurred = second("subject");
  fail_unless(sharp == second("off", false), "what was drawn before is seen");
  const int more = touched(blurred) - touched(sharp);
  fail_unless(more > 150 && more < 600, "%d pixels more", more);
  fail_unless(std::abs(middle(blurred) - middle(sharp)) < 0.3, "%g, sharp %g", middle(blurred),
              middle(sharp));
}

// The shutter is open for a frame's time, however long ago the last frame was; another camera and a flush are cuts.
ELEMENT_TEST(test_motion_blur_over_gaps_and_cuts) {
  const auto second = [](int number, double target, bool flush) {
    LensBench bench;
    gst_util_set_object_arg(G_OBJECT(bench.element), "motion-blur", "subject");
    g_object_set(bench.element, "shutter-angle", 360.0, nullptr);
    shown(bench, 0);
    if (flush) {
      GstPad* pad = GST_PAD_PEER(bench.background->srcpad);
      fail_unless(gst_pad_send_event(pad, gst_event_new_flush_start()));
      fail_unless(gst_pad_send_event(pad, gst_event_new_flush_stop(TRUE)));
      GstSegment segment;
      gst_segment_init(&segment, GST_FORMAT_TIME);
      gst_harness_push_event(bench.background, gst_event_new_segment(&segment));
    }
    g_object_set(bench.element, "target-x", target, nullptr);
    const Pixels picture = shown(bench, number);
    fail_unless(count_of(bench.element, "drawn") > 0);
    return std::pair(touched(picture), count_of(bench.element, "motion-blurred"));
  };
  const auto [next, blurred] = second(1, 0.95, false);
  const auto [later, blurred_later] = second(4, 0.95, false);
  fail_unless_equals_int(blurred, 1);
  fail_unless_equals_int(blurred_later, 1);
  fail_unless(next > later + 150, "%d, after a gap %d", next, later);
  // A pan of four degrees a frame of which every fourth is drawn.
  fail_unless_equals_int(second(1, 0.15, false).second, 0);
  fail_unless_equals_int(second(4, 0.15, false).second, 1);
  fail_unless_equals_int(second(40, 0.95, false).second, 0);  // that was a second and a half ago
  fail_unless_equals_int(second(1, -3.0, false).second, 0);
  fail_unless_equals_int(second(1, 0.95, true).second, 0);
}

// A camera of another name is another one, however near it stands.
ELEMENT_TEST(test_motion_blur_knows_cameras_apart) {
  for (const bool other : {false, true}) {
    LensBench bench;
    gst_util_set_object_arg(G_OBJECT(bench.element), "motion-blur", "subject");
    Announcement announcement;
    announcement.viewport = bench_camera();
    announcement.viewport.name = "one";
    announce(bench, announcement);
    shown(bench, 0);
    announcement.viewport.t.x += 0.1;
    if (other) announcement.viewport.name = "two";
    announce(bench, announcement);
    shown(bench, 1);
    fail_unless_equals_uint64(count_of(bench.element, "motion-blurred"), other ? 0 : 1);
  }
}

// A background whose depth nobody knows is blurred as if it were without end, and a warning says so.
ELEMENT_TEST(test_blur_without_a_scene_warns) {
  LensBench bench;
  gst_util_set_object_arg(G_OBJECT(bench.element), "depth-of-field", "subject");
  g_object_set(bench.element, "aperture", 50.0, nullptr);
  shown(bench, 0);
  fail_unless_equals_int(count_of(bench.element, "lens-without-scene"), 0);
  gst_util_set_object_arg(G_OBJECT(bench.element), "depth-of-field", "picture");
  shown(bench, 1);
  fail_unless_equals_int(count_of(bench.element, "lens-without-scene"), 1);
  g_object_set(bench.element, "scene", "builtin:room", nullptr);
  shown(bench, 2);
  fail_unless_equals_int(count_of(bench.element, "lens-without-scene"), 1);
}

// Grain and fall-off reach pictures without any subject, depend on the frame's time alone, and stay off
// where they are off.
ELEMENT_TEST(test_sensor_without_a_mesh) {
  const auto frames = [](double grain, double a1, int first) {
    Bench bench(false);
    g_object_set(bench.element, "grain", grain, "falloff-a1", a1, nullptr);
    std::vector<Pixels> out;
    for (int i = first; i < first + 2; ++i) {
      gst_harness_push(bench.background, frame(frame_time(i)));
      out.push_back(pixels_of(bench.pull()));
    }
    return out;
  };
  const std::vector<Pixels> plain = frames(0.0, 0.0, 0);
  for (const std::uint8_t value : plain[0]) fail_unless_equals_int(value, grey);
  const std::vector<Pixels> one = frames(0.03, 0.0, 0), again = frames(0.03, 0.0, 1);
  fail_unless(one[0] != one[1] && one[0] != plain[0]);
  fail_unless(one[1] == again[0], "the grain of a frame is not its own");
  const std::vector<Pixels> dark = frames(0.0, -1.0, 0);
  const std::size_t middle = 4 * (90 * width + 160);
  fail_unless_equals_int(dark[0][middle], grey);
  fail_unless(dark[0][0] < grey - 20, "%d", dark[0][0]);
}

ELEMENT_TEST(test_absurd_lens_is_survived) {
  LensBench bench;
  for (int i = 0; i < 3; ++i) {
    set_distortion(bench.element, {i == 0 ? 10.0 : -10.0, i == 1 ? -10.0 : 10.0, -10, 10, -10});
    shown(bench, i);
  }
  set_distortion(bench.element, {0, 0, 0, 0, 0});
  for (const char* blur : {"depth-of-field", "motion-blur"})
    gst_util_set_object_arg(G_OBJECT(bench.element), blur, "picture");
  for (int i = 0; i < 4; ++i) {
    Announcement announcement;
    announcement.viewport = bench_camera();
    announcement.aperture = i < 2 ? 1e300 : 1e-300;
    announcement.focus_distance = i % 2 ? 1e300 : 1e-300;
    announce(bench, announcement);
    shown(bench, 3 + i);
  }
  // What is no lens at all is left out, and counted.
  for (const char* json : {"{\"format\":\"polyhull-announcement\",\"aperture\":-1}", "[]", "nan"})
    gst_harness_push_event(bench.background, announcement_event(json));
  shown(bench, 7);
  fail_unless(count_of(bench.element, "announcements-unusable") > 0);
}
