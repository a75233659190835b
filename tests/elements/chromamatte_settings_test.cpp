// SPDX-License-Identifier: LGPL-2.1-or-later
// chromamatte's properties: what each does to the matte, and what is said where one cannot be used.
#include <gst/check/gstharness.h>

#include <cmath>
#include <fstream>

#include "base/picture.h"
#include "elements/controlled.h"
#include "elements/element_checks.h"
#include "elements/keyed_disk.h"
#include "support/folder.h"

using namespace polyhull::test;

namespace {

const Folder folder;

polyhull::Picture plate_picture(int w, int h, const Colour& c) {
  polyhull::Picture picture{w, h, 3, {}};
  for (int i = 0; i < w * h; ++i) {
    for (const double v : {c.r, c.g, c.b}) picture.pixels.push_back(static_cast<std::uint8_t>(v));
  }
  return picture;
}

}  // namespace

ELEMENT_TEST(properties_act_on_the_next_frame) {
  GstHarness* h = harness_for("chromamatte name=key");
  GstElement* key = gst_harness_find_element(h, "chromamatte");
  GstBuffer* out = pushed(h, "RGBx", subject);
  fail_unless(alpha_area(out, width, height) > 900);
  gst_buffer_unref(out);

  g_object_set(key, "roi-x", 0, "roi-width", 10, nullptr);
  out = pushed(h, "RGBx", subject, GST_SECOND);
  fail_unless_equals_float(alpha_area(out, width, height), 0.0);
  gst_buffer_unref(out);

  g_object_set(key, "roi-width", 0, "inside-polygon", "-1,-1 200,-1 200,200 -1,200", nullptr);
  out = pushed(h, "RGBx", subject, 2 * GST_SECOND);
  fail_unless_equals_float(alpha_area(out, width, height), width * height);
  gst_buffer_unref(out);

  g_object_set(key, "inside-polygon", "", "outside-polygon", "-1,-1 40.5,-1 40.5,99 -1,99",
               nullptr);
  out = pushed(h, "RGBx", subject, 3 * GST_SECOND);
  const double half = alpha_area(out, width, height);
  fail_unless(std::abs(half - disk_area / 2) < 0.05 * disk_area, "%g", half);
  gst_buffer_unref(out);
  gst_object_unref(key);
  gst_harness_teardown(h);
}

/// Pictures, polygons and the rig's bounds rule in and out, each by itself and all at once.
ELEMENT_TEST(garbage_mattes_rule_in_and_out) {
  // Columns 0 to 29 are masked; the box, 10 units away, covers columns 20 to 60 and rows 10 to 40.
  const std::string mask = folder.file("mask.png"), rig = folder.file("rig.json");
  polyhull::Picture left{width, height, 1, std::vector<std::uint8_t>(width * height, 0)};
  for (int y = 0; y < height; ++y) std::fill_n(left.row(y), 30, 255);
  polyhull::save_picture(left, mask);
  std::ofstream(rig)
      << R"({"format":"polyhull-rig","version":1,"cameras":[{"name":"left","width":96,
    "height":64,"K":[[100,0,0],[0,100,0],[0,0,1]],"R":[[1,0,0],[0,1,0],[0,0,1]],"t":[0,0,0]}],
    "bounds":{"min":[2,1,10],"max":[6,4,10.000001]}})";
  const auto masked = [](int x, int) { return x < 30; };
  const auto boxed = [](int x, int y) { return x >= 20 && x <= 60 && y >= 10 && y <= 40; };
  const auto near_box = [](int x, int y) {  // a pixel's centre on the box's edge is either
    return (std::abs(x - 20) < 2 || std::abs(x - 60) < 2 || std::abs(y - 10) < 2 ||
            std::abs(y - 40) < 2);
  };
  const std::string polygon = "outside-polygon=\"-1,24.5 99,24.5 99,99 -1,99\"";
  const struct {
    std::string properties;
    std::function<bool(int, int)> in, out;
  } cases[] = {
      {"inside-mask=" + mask, masked, [](int, int) { return false; }},
      {"outside-mask=" + mask, [](int, int) { return false; }, masked},
      {"rig=" + rig + " camera=left", [](int, int) { return false; },
       [&](int x, int y) { return !boxed(x, y); }},
      {"name=left rig=" + rig, [](int, int) { return false; },
       [&](int x, int y) { return !boxed(x, y); }},
      {"rig=" + rig + " camera=left outside-mask=" + mask + " " + polygon +
           " inside-polygon=\"-1,-1 99,-1 99,99 -1,99\"",
       [](int, int) { return true; },
       [&](int x, int y) { return !boxed(x, y) || masked(x, y) || y < 25; }},
  };
  GstHarness* plain = harness_for("chromamatte");
  GstBuffer* free = pushed(plain, "RGBx", subject);
  std::vector<int> alpha;
  for_each_pixel(free, width, height,
                 [&](int, int, const std::uint8_t* p) { alpha.push_back(p[3]); });
  gst_buffer_unref(free);
  gst_harness_teardown(plain);
  for (const auto& c : cases) {
    GstHarness* h = harness_for("chromamatte " + c.properties);
    GstBuffer* out = pushed(h, "RGBx", subject);
    for_each_pixel(out, width, height, [&](int x, int y, const std::uint8_t* p) {
      if (c.properties.find("rig=") != std::string::npos && near_box(x, y)) return;
      const int expected = c.out(x, y) ? 0 : c.in(x, y) ? 255 : alpha[y * width + x];
      fail_unless(p[3] == expected, "%s: %d instead of %d at %d,%d", c.properties.c_str(), p[3],
                  expected, x, y);
    });
    gst_buffer_unref(out);
    gst_harness_teardown(h);
  }
}

ELEMENT_TEST(a_controller_drives_properties) {
  GstHarness* h = harness_for("chromamatte");
  GstElement* key = gst_harness_find_element(h, "chromamatte");
  control(key, "roi-x", 0.0, 90.0, GST_SECOND, GST_INTERPOLATION_MODE_NONE);
  GstBuffer* out = pushed(h, "RGBx", subject, 0);
  fail_unless(alpha_area(out, width, height) > 900);
  gst_buffer_unref(out);
  out = pushed(h, "RGBx", subject, GST_SECOND);
  fail_unless_equals_float(alpha_area(out, width, height), 0.0);
  gst_buffer_unref(out);
  gst_object_unref(key);
  gst_harness_teardown(h);
}

ELEMENT_TEST(a_clean_plate_keys_without_a_screen) {
  const std::string path = folder.file("plate.png");
  polyhull::save_picture(plate_picture(width, height, {120, 110, 100}), path);
  Disk room = subject;
  room.screen = {120, 110, 100};
  GstHarness* h = harness_for("chromamatte method=difference clean-plate=" + path);
  GstBuffer* out = pushed(h, "RGBx", room);
  const double area = alpha_area(out, width, height);
  fail_unless(std::abs(area - disk_area) < 0.08 * disk_area, "%g instead of %g", area, disk_area);
  gst_buffer_unref(out);
  // A soft shadow on the wall is no subject.
  room.subject = {90, 82, 75};
  out = pushed(h, "RGBx", room, GST_SECOND);
  fail_unless_equals_float(alpha_area(out, width, height), 0.0);
  gst_buffer_unref(out);
  gst_harness_teardown(h);
}

ELEMENT_TEST(learns_a_clean_plate) {
  GstHarness* h = harness_for("chromamatte method=difference learn-plate=5");
  GstElement* key = gst_harness_find_element(h, "chromamatte");
  Disk room = subject;
  room.screen = {120, 110, 100};
  Disk empty = room;
  empty.subject = room.screen;
  for (int i = 0; i < 5; ++i) gst_buffer_unref(pushed(h, "RGBx", empty, i * GST_SECOND));
  fail_unless_equals_int(static_cast<int>(statistic(key, "plate-frames-left")), 0);
  GstBuffer* out = pushed(h, "RGBx", room, 5 * GST_SECOND);
  const double area = alpha_area(out, width, height);
  fail_unless(std::abs(area - disk_area) < 0.08 * disk_area, "%g instead of %g", area, disk_area);
  gst_buffer_unref(out);
  gst_object_unref(key);
  gst_harness_teardown(h);
}

/// The sentence of the error that the line ends with; fails if it ends without one.
static std::string error_of(const std::string& properties) {
  const std::string result = run_to_end(
      "videotestsrc num-buffers=3 ! video/x-raw,format=RGBx,width=64,height=48 ! "
      "chromamatte " +
      properties + " ! fakesink");
  fail_if(result.empty(), "%s was accepted", properties.c_str());
  // It says what to do.
  bool remedy = false;
  for (const char* verb : {"give ", "set ", "Set ", "lower ", "write ", "add ", "use ", "wants "})
    remedy |= result.find(verb) != std::string::npos;
  fail_unless(remedy, "%s", result.c_str());
  return result;
}

/// The lamps go down while the stream runs: followed, or sampled again, the screen stays background.
ELEMENT_TEST(samples_again_when_asked_to) {
  Disk dim = subject;
  dim.screen = {22, 112, 40};
  for (const int resample : {0, 3}) {
    GstHarness* h = harness_for("chromamatte resample=" + std::to_string(resample));
    for (int i = 0; i < 3; ++i) gst_buffer_unref(pushed(h, "RGBx", subject, i * GST_SECOND));
    double area = 0.0;
    for (int i = 3; i < 7; ++i) {
      GstBuffer* out = pushed(h, "RGBx", dim, i * GST_SECOND);
      area = alpha_area(out, width, height);
      gst_buffer_unref(out);
    }
    const bool right = std::abs(area - disk_area) < 0.03 * disk_area;
    fail_unless(right, "resample=%d: %g of %g", resample, area, disk_area);
    gst_harness_teardown(h);
  }
}

ELEMENT_TEST(bad_input_is_refused_with_a_sentence) {
  fail_unless(error_of("clean-plate=/nowhere/plate.png").find("/nowhere/plate.png") !=
              std::string::npos);
  const std::string small = folder.file("small.png");
  polyhull::save_picture(plate_picture(8, 8, {0, 0, 0}), small);
  for (const char* property : {"clean-plate", "inside-mask", "outside-mask"}) {
    const std::string message = error_of(std::string(property) + "=" + small);
    fail_unless(message.find("8x8") != std::string::npos &&
                    message.find("64x48") != std::string::npos &&
                    message.find(property) != std::string::npos,
                "%s", message.c_str());
  }
  const std::string broken = folder.file("broken.png");
  std::ofstream(broken) << "no picture";
  fail_unless(error_of("clean-plate=" + broken).find(broken) != std::string::npos);
  error_of("outside-polygon=\"1,2 3,4\"");
  error_of("inside-polygon=\"1,2 3,4 nan,5\"");
  const std::string clip = error_of("clip-black=0.8 clip-white=0.2");
  fail_unless(clip.find("clip-black (0.8)") != std::string::npos &&
                  clip.find("clip-white (0.2)") != std::string::npos,
              "%s", clip.c_str());
  error_of("difference-low=50 difference-high=20");
  fail_unless(error_of("rig=/nowhere/rig.json").find("/nowhere/rig.json") != std::string::npos);
}

ELEMENT_TEST(a_bad_value_in_the_stream_is_a_warning) {
  GstHarness* h = harness_for("chromamatte");
  GstElement* key = gst_harness_find_element(h, "chromamatte");
  GstBus* bus = gst_bus_new();
  gst_element_set_bus(h->element, bus);
  gst_buffer_unref(pushed(h, "RGBx", subject));
  g_object_set(key, "clean-plate", "/nowhere/plate.png", nullptr);
  for (int i = 1; i < 4; ++i) {
    GstBuffer* out = pushed(h, "RGBx", subject, i * GST_SECOND);
    fail_unless(alpha_area(out, width, height) > 900);
    gst_buffer_unref(out);
  }
  fail_unless_equals_int(static_cast<int>(statistic(key, "refused-settings")), 1);
  GstMessage* message = gst_bus_pop_filtered(bus, GST_MESSAGE_WARNING);
  fail_unless(message != nullptr);
  gst_message_unref(message);
  g_object_set(key, "clean-plate", nullptr, "strength", 40, nullptr);
  gst_buffer_unref(pushed(h, "RGBx", subject, 5 * GST_SECOND));
  fail_unless_equals_int(static_cast<int>(statistic(key, "refused-settings")), 1);
  gst_element_set_bus(h->element, nullptr);
  gst_object_unref(bus);
  gst_object_unref(key);
  gst_harness_teardown(h);
}

/// Frames keyed without what the method needs are counted, and a person reads what to set.
ELEMENT_TEST(says_what_the_method_lacks) {
  const struct {
    const char *properties, *counter, *remedy;
    bool screen;  // in the picture
    int counted;  // of four frames
  } cases[] = {
      {"method=difference", "frames-without-plate", "clean-plate", true, 4},
      {"method=difference key=auto", "frames-without-plate", "learn-plate", true, 4},
      {"method=difference learn-plate=2", "frames-without-plate", "", true, 0},
      {"method=difference learn-plate=9", "frames-without-plate", "", true, 0},
      {"method=difference key=colour key-colour=0x1ebe3c", "frames-without-plate", "", true, 0},
      {"key=colour key-colour=0", "frames-without-plate", "", true, 0},
      {"", "frames-without-screen", "", true, 0},
      {"", "frames-without-screen", "to auto", false, 4},
      {"key=blue", "frames-without-screen", "screen-colour", true, 4},
      {"screen-colour=0x1ebe3c", "frames-without-screen", "", false, 0},
      {"method=prototype", "frames-without-screen", "", false, 0},
  };
  for (const auto& c : cases) {
    GstHarness* h = harness_for(std::string("chromamatte ") + c.properties);
    GstElement* key = gst_harness_find_element(h, "chromamatte");
    GstBus* bus = gst_bus_new();
    gst_element_set_bus(h->element, bus);
    Disk disk = subject;
    if (!c.screen) disk.screen = {110, 105, 100};
    for (int i = 0; i < 4; ++i) gst_buffer_unref(pushed(h, "RGBx", disk, i * GST_SECOND));
    fail_unless_equals_int(static_cast<int>(statistic(key, c.counter)), c.counted);
    GstMessage* message = gst_bus_pop_filtered(bus, GST_MESSAGE_WARNING);
    fail_unless((message != nullptr) == (c.counted > 0), "%s", c.properties);
    if (message != nullptr) {
      GError* error = nullptr;
      gst_message_parse_warning(message, &error, nullptr);
      fail_unless(std::string(error->message).find(c.remedy) != std::string::npos, "%s: %s",
                  c.properties, error->message);
      g_error_free(error);
      gst_message_unref(message);
      fail_unless(gst_bus_pop_filtered(bus, GST_MESSAGE_WARNING) == nullptr, "said twice");
    }
    gst_element_set_bus(h->element, nullptr);
    gst_object_unref(bus);
    gst_object_unref(key);
    gst_harness_teardown(h);
  }
}

ELEMENT_TEST(not_a_number_changes_nothing) {
  GstElement* key = gst_element_factory_make("chromamatte", nullptr);
  g_object_set(key, "choke", 1.5, nullptr);
  // GObject complains by itself; the value stays.
  ASSERT_WARNING(g_object_set(key, "choke", std::nan(""), nullptr));
  gdouble choke = 0.0;
  g_object_get(key, "choke", &choke, nullptr);
  fail_unless_equals_float(choke, 1.5);
  gst_object_unref(key);
}

ELEMENT_TEST(a_region_outside_of_the_frame_is_empty) {
  GstHarness* h = harness_for("chromamatte roi-x=5000 roi-y=10");
  GstBuffer* out = pushed(h, "RGBx", subject);
  fail_unless_equals_float(alpha_area(out, width, height), 0.0);
  gst_buffer_unref(out);
  gst_harness_teardown(h);
}
