// SPDX-License-Identifier: LGPL-2.1-or-later
// tracksrc with FreeD: its settings, what its senders do differently, and lens files for its encoders.
#include <fstream>
#include <string>
#include <utility>

#include "element_checks.h"
#include "tracksrc_bench.h"

using namespace polyhull;
using namespace polyhull::test;

ELEMENT_TEST(test_freed) {
  Bench bench("port=0 delay=30000000 prediction=5000000");
  const Came came = bench.at(100 * ms, freed(7, {90, 0, 0}, {1.5, -2.25, 3.125}, 2500, 0));
  fail_unless_equals_uint64(came.time, 70 * ms);
  expect_near(came.message.pose.place, {1.5, -2.25, 3.125}, 1e-12);
  expect_near(came.message.pose.axes[1], {1, 0, 0}, 1e-12);  // to the right: along x
  fail_unless(came.message.pose.source == "freed 7 from 127.0.0.1");
  fail_if(came.message.pose.focal_length_mm.has_value());
  fail_unless_equals_int64(came.message.prediction_ns, 5000000);
  fail_unless_equals_uint64(statistic(bench.element, "poses"), 1);
}

ELEMENT_TEST(test_settings_of_freed_change_live) {
  Bench bench("port=0 axes=y-xz invert-pan=true offset-z=10 zoom-is-focal-length=true");
  const Packet packet = freed(1, {90, 0, 0}, {1, 2, 3}, 2500, 0);
  Came came = bench.at(10 * ms, packet);
  expect_near(came.message.pose.place, {2, -1, 13}, 1e-12);
  expect_near(came.message.pose.axes[1], {-1, 0, 0}, 1e-12);
  fail_unless(came.message.pose.focal_length_mm == 25.0);
  fail_if(came.message.pose.sensor_width_mm.has_value());
  g_object_set(bench.element, "axes", "xyz", "offset-pan", -90.0, "sensor-width", 35.0, nullptr);
  came = bench.at(20 * ms, packet);
  expect_near(came.message.pose.place, {1, 2, 13}, 1e-12);
  expect_near(came.message.pose.axes[1], {0, -1, 0}, 1e-12);
  fail_unless(came.message.pose.sensor_width_mm == 35.0);
  // Axes that are none: said, and mended live.
  for (const char* axes : {"", "xy", "xxz", "xyzx", "x y z", "xy--z", "nonsense"}) {
    g_object_set(bench.element, "axes", axes, nullptr);
    bench.nothing_of(packet, "settings-refused");
  }
  const auto said = warnings_on(bench.bus);
  fail_unless(said.size() >= 2);
  expect_in(said[0], {"sensor-width"});  // of the focal length alone
  expect_in(said[1], {"axes=", "y-xz"});
  g_object_set(bench.element, "axes", "zyx", nullptr);
  expect_near(bench.at(30 * ms, packet).message.pose.place, {3, 2, 11}, 1e-12);
}

// Of Z CAM's heads and others: cameras of any number, no checksum, a line end behind, polls between.
ELEMENT_TEST(test_freed_as_others_send_it) {
  Bench bench("port=0 source=\"freed 255\"");
  Packet packet = at_x(1, 255);
  packet.insert(packet.end(), {'\r', '\n'});
  fail_unless(bench.at(10 * ms, packet).x() == 1.0);
  bench.nothing_of({0xD0, 0x01, 0xD1, 0x9E}, "polls");
  fail_unless_equals_int(warnings_on(bench.bus).size(), 0);
  packet = at_x(2, 255);
  packet.back() = 0;
  bench.nothing_of(packet, "bad-checksum");
  bench.expect_one_warning({"checksum=zero-is-none"});
  gst_util_set_object_arg(G_OBJECT(bench.element), "checksum", "zero-is-none");
  fail_unless(bench.at(20 * ms, packet).x() == 2.0);
}

// What a packet holds may be any bytes, messages are UTF-8.
ELEMENT_TEST(test_messages_quote_in_utf8) {
  Bench bench("port=0");
  const std::string latin1 = "{\"sourceId\": \"K\xFChe\"}";
  bench.nothing_of({latin1.begin(), latin1.end()}, "refused");
  const std::string said = bench.expect_one_warning({"ill-formed UTF-8", "\"K"});
  fail_unless(g_utf8_validate(said.c_str(), -1, nullptr));
}

ELEMENT_TEST(test_several_packets_in_a_datagram) {
  Bench bench("port=0");
  Packet all;
  for (const auto& [x, camera] : {std::pair{1, 1}, {9, 89}, {2, 1}, {3, 1}})
    for (const std::uint8_t byte : at_x(x, static_cast<std::uint8_t>(camera))) all.push_back(byte);
  gst_harness_set_time(bench.harness, 10 * ms);
  bench.send(all);
  for (const double x : {1.0, 2.0, 3.0}) {
    const Came came = bench.pull();
    fail_unless(came.x() == x);
    fail_unless_equals_uint64(came.time, 10 * ms);
  }
  fail_unless_equals_uint64(statistic(bench.element, "other-senders"), 1);
  fail_unless(bench.at(20 * ms, at_x(4)).x() == 4.0);
}

// Encoders taken for focal lengths are noticed once.
ELEMENT_TEST(test_implausible_focal_lengths) {
  Bench bench("port=0 zoom-is-focal-length=true sensor-width=13.2");
  for (guint64 i = 0; i < 3; ++i)
    bench.at((10 + i) * ms,
             freed(1, {0, 0, 0}, {0, 0, 0}, 950 + 900 * static_cast<unsigned>(i), 0));
  fail_unless_equals_uint64(statistic(bench.element, "lenses-doubtful"), 0);
  for (guint64 i = 0; i < 3; ++i) bench.at((20 + i) * ms, freed(1, {0, 0, 0}, {0, 0, 0}, 28900, 0));
  fail_unless_equals_uint64(statistic(bench.element, "lenses-doubtful"), 3);
  bench.expect_one_warning({"289 mm", "zoom-is-focal-length", "lens-file"});
}

// A zoom that moves without anything that says what the lens does there, once; an encoder that stands and
// shakes by some counts is none.
ELEMENT_TEST(test_a_zoom_that_nothing_follows) {
  Bench bench("port=0");
  const auto at = [&](guint64 i, unsigned zoom) {
    bench.at((10 + i) * ms, freed(1, {0, 0, 0}, {0, 0, 0}, zoom, 0));
  };
  for (guint64 i = 0; i < 3; ++i) at(i, 5000 + 7 * (i % 2));
  fail_unless_equals_uint64(statistic(bench.element, "lenses-doubtful"), 0);
  Bench fixed("port=0");  // a lens without zoom may tell 0, and now and then 1
  for (guint64 i = 0; i < 3; ++i) fixed.at((10 + i) * ms, freed(1, {0, 0, 0}, {0, 0, 0}, i % 2, 0));
  fail_unless_equals_uint64(statistic(fixed.element, "lenses-doubtful"), 0);
  for (guint64 i = 3; i < 6; ++i) at(i, 6000);
  fail_unless_equals_uint64(statistic(bench.element, "lenses-doubtful"), 3);
  bench.expect_one_warning({"zoom moves", "lens-file", "zoom-is-focal-length"});
}

ELEMENT_TEST(test_lens_file) {
  std::ofstream(path("lens.csv")) << "Zoom,Focal length (mm),k1,Entrance pupil (mm)\n"
                                     "0,10,-0.1,100\n1000,30,0.1,300\n"
                                     "Focus,Focus distance (m)\n0,1\n1000,inf\n";
  Bench bench("port=0 sensor-width=13.2 lens-file=" + path("lens.csv"));
  const auto at = [&](GstClockTime time, unsigned zoom) {
    return bench.at(time, freed(1, {0, 0, 0}, {1, 2, 3}, zoom, 500)).message.pose;
  };
  const TrackedPose pose = at(10 * ms, 500);
  fail_unless(std::abs(*pose.focal_length_mm - 20.0) < 1e-9);
  fail_unless(pose.sensor_width_mm == 13.2);
  fail_unless(std::abs(pose.distortion.at(0)) < 1e-9);
  fail_unless(std::abs(*pose.focus_distance_m - 2.0) < 1e-9);
  expect_near(pose.place, {1, 2.2, 3}, 1e-9);
  fail_unless_equals_int(warnings_on(bench.bus).size(), 0);
  // Beyond its rows the last one holds; said each time that it goes there.
  fail_unless(at(20 * ms, 1001).focal_length_mm == 30.0);
  at(30 * ms, 1002);
  fail_unless_equals_uint64(statistic(bench.element, "lenses-outside"), 2);
  bench.expect_one_warning({"lens.csv", "beyond"});
}

ELEMENT_TEST(test_lens_file_without_a_sensor) {
  std::ofstream(path("lens.csv")) << "zoom focal_length_mm\n0 10\n";
  Bench bench("port=0 lens-file=" + path("lens.csv"));
  bench.at(10 * ms, at_x(1));
  bench.at(20 * ms, at_x(1));
  bench.expect_one_warning({"sensor-width"});
  nlohmann::json value = sample({0, 0, 0}, {1, 0, 0});
  value["lens"] = {{"encoders", {{"zoom", 0.5}}}};
  std::ofstream(path("lens.csv")) << "zoom focal_length_mm\n0 10\n1000 20\n";
  Bench other("port=0 lens-file=" + path("lens.csv"));
  other.at(10 * ms, json_bytes(value));
  other.expect_one_warning({"lens.csv", "lens.encoders", "rawEncoders"});
}
