// SPDX-License-Identifier: LGPL-2.1-or-later
// tracksrc: packets over UDP and from recordings as poses on a clock that the tests set.
#include <gst/check/gstharness.h>
#include <gst/check/gsttestclock.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "../lib/track/packets.h"
#include "controlled.h"
#include "element_checks.h"
#include "track/packet_file.h"
#include "tracksrc_bench.h"

using namespace polyhull;
using namespace polyhull::test;
using namespace polyhull::track_examples;

namespace {

/// An OpenTrackIO packet under the number \p sequence, taken at the time \p taken of its clock.
Packet numbered(std::uint16_t sequence, double x, GstClockTime taken = 1718806554 * GST_SECOND) {
  nlohmann::json value = sample({0, 0, 0}, {x, 0, 0});
  value["timing"]["sequenceNumber"] = sequence;
  value["timing"]["sampleTimestamp"] = {{"seconds", taken / GST_SECOND},
                                        {"nanoseconds", taken % GST_SECOND}};
  const Packet text = json_bytes(value);
  return segment(text, 1, sequence, 0, text.size(), 255);
}

/// A recording of \p count poses, 10 ms and 10 mm apart.
std::string recording(const char* name, int count) {
  PacketRecorder recorder(path(name), 55555);
  for (int i = 0; i < count; ++i)
    recorder.write({static_cast<std::int64_t>(10 * ms) * i, 0x7F000001, 4000, at_x(0.01 * i)});
  return path(name);
}

/// All that tracksrc plays of a recording.
std::vector<Came> played(const std::string& properties, std::string* warning = nullptr) {
  GstElement* pipeline = parse("tracksrc name=t " + properties +
                               " ! fakesink name=sink signal-handoffs=true sync=false");
  GstElement* sink = named(pipeline, "sink");
  std::vector<Came> result;
  const auto keep = +[](GstElement*, GstBuffer* buffer, GstPad*, std::vector<Came>* to) {
    to->push_back(came_in(gst_buffer_ref(buffer)));
  };
  g_signal_connect(sink, "handoff", G_CALLBACK(keep), &result);
  GstBus* bus = gst_element_get_bus(pipeline);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GstMessage* message = nullptr;
  for (;;) {
    message = gst_bus_timed_pop_filtered(
        bus, 60 * GST_SECOND,
        static_cast<GstMessageType>(GST_MESSAGE_EOS | GST_MESSAGE_ERROR | GST_MESSAGE_WARNING));
    if (message == nullptr || GST_MESSAGE_TYPE(message) != GST_MESSAGE_WARNING) break;
    GError* error = nullptr;
    gst_message_parse_warning(message, &error, nullptr);
    if (warning) *warning = error->message;
    g_clear_error(&error);
    gst_message_unref(message);
  }
  fail_unless(message != nullptr && GST_MESSAGE_TYPE(message) == GST_MESSAGE_EOS, "%s",
              properties.c_str());
  gst_message_unref(message);
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(bus);
  gst_object_unref(pipeline);
  return result;
}

GstClockTime latency_of(GstElement* element) {
  GstQuery* query = gst_query_new_latency();
  gboolean live = FALSE;
  GstClockTime least = 0;
  fail_unless(gst_element_query(element, query));
  gst_query_parse_latency(query, &live, &least, nullptr);
  gst_query_unref(query);
  return live ? least : GST_CLOCK_TIME_NONE;
}

}  // namespace

ELEMENT_TEST(test_documented) {
  check_documented("tracksrc");
}

// A controlled property is, for each packet, what it is when that comes, recorded or not.
ELEMENT_TEST(test_controllers) {
  const std::string file = path("controlled.pcap");
  {
    Bench bench("port=0 record=" + file);
    control(bench.element, "offset-x", 0.0, 1.0, GST_SECOND);
    for (guint64 i = 1; i <= 5; ++i)
      expect_near(bench.at(i * 100 * ms, at_x(0)).message.pose.place,
                  {0.1 * static_cast<double>(i), 0, 0}, 1e-9);
  }
  GstHarness* harness = gst_harness_new_parse(("tracksrc location=" + file).c_str());
  GstElement* element = gst_harness_find_element(harness, "tracksrc");
  control(element, "offset-x", 0.0, 1.0, GST_SECOND);
  gst_harness_play(harness);
  for (int i = 1; i <= 5; ++i)
    expect_near(came_in(gst_harness_pull(harness)).message.pose.place, {0.1 * i, 0, 0}, 1e-9);
  gst_object_unref(element);
  gst_harness_teardown(harness);
}

ELEMENT_TEST(test_opentrackio) {
  Bench bench("port=0 protocol=opentrackio");
  const nlohmann::json value = sample({90, 30, 0}, {1.5, -2.25, 3.125});
  const Packet text = json_bytes(value), cbor = nlohmann::json::to_cbor(value);
  const Packet packets[] = {text, segment(text, 1, 700, 0, text.size(), 255),
                            segment(cbor, 2, 701, 0, cbor.size(), 256)};
  GstClockTime time = 0;
  for (const Packet& packet : packets) {
    const Came came = bench.at(time += 20 * ms, packet);
    fail_unless_equals_uint64(came.time, time);
    expect_near(came.message.pose.place, {1.5, -2.25, 3.125}, 1e-12);
    expect_near(came.message.pose.axes[1], {-std::cos(M_PI / 6), 0, 0.5}, 1e-12);
    fail_unless(came.message.pose.focal_length_mm == 24.5);
    fail_unless(came.message.pose.sensor_width_mm == 36.0);
    expect_in(came.message.pose.source, {"urn:uuid:00000000-0000-4000-8000-000000000007 from"});
  }
  // In segments, the last one first.
  const std::size_t half = cbor.size() / 2;
  bench.send(segment(cbor, 2, 702, half, cbor.size() - half, 255));
  expect_near(bench.at(100 * ms, segment(cbor, 2, 702, 0, half, 255)).message.pose.place,
              {1.5, -2.25, 3.125}, 1e-12);
}

ELEMENT_TEST(test_loss_reordering_and_repetition) {
  Bench bench("port=0");
  bench.at(10 * ms, numbered(10, 0.1));
  bench.at(20 * ms, numbered(14, 0.4));  // three are missing
  fail_unless_equals_uint64(statistic(bench.element, "lost"), 3);
  bench.nothing_of(numbered(12, 0.2), "reordered");
  fail_unless_equals_uint64(statistic(bench.element, "lost"), 2);
  bench.nothing_of(numbered(14, 0.4), "repeated");
  fail_unless(bench.at(30 * ms, numbered(15, 0.5)).x() == 0.5);
  fail_unless_equals_uint64(statistic(bench.element, "poses"), 3);
}

ELEMENT_TEST(test_two_senders) {
  Bench bench("port=0");
  const Tracker other("127.0.0.2");
  fail_unless(bench.at(100 * ms, at_x(1)).x() == 1.0);
  // Another camera, and another machine under the same number.
  bench.nothing_of(at_x(50, 2), "other-senders");
  bench.nothing_of(at_x(60), "other-senders", other);
  // The first one has been silent for more than a second: another may follow.
  gst_harness_set_time(bench.harness, 1200 * ms);
  bench.send(at_x(60), other);
  fail_unless(bench.pull().x() == 60.0);
  bench.nothing_of(at_x(1), "other-senders");
  // The one that is asked for, at once.
  g_object_set(bench.element, "source", "freed 2", nullptr);
  bench.nothing_of(at_x(60), "other-senders", other);
  fail_unless(bench.at(1300 * ms, at_x(50, 2)).x() == 50.0);
}

ELEMENT_TEST(test_bad_packets_are_counted_and_the_rest_is_used) {
  Bench bench("port=0");
  bench.at(10 * ms, at_x(1));
  Packet bad = at_x(2);
  bad[9] ^= 0x10;
  bench.nothing_of(bad, "bad-checksum");
  bench.nothing_of(Packet(bad.begin(), bad.begin() + 20), "truncated");
  bad.push_back(0);
  bench.nothing_of(bad, "bad-checksum");
  bench.nothing_of({0xC1, 1, 2, 3}, "refused");
  bench.nothing_of({'G', 'E', 'T', ' ', '/'}, "refused");
  bench.nothing_of({}, "refused");
  bench.nothing_of(Packet(60000, '{'), "refused");
  Packet whole = numbered(1, 1.0);
  whole[30] ^= 1;
  bench.nothing_of(whole, "bad-checksum");
  bench.nothing_of(Packet(whole.begin(), whole.begin() + 100), "truncated");
  const auto said = warnings_on(bench.bus);
  fail_unless(said.size() >= 3);  // of each counter one a second
  expect_in(said[0], {"127.0.0.1:", "checksum"});
  fail_unless(bench.at(20 * ms, at_x(3)).x() == 3.0);
  fail_unless_equals_uint64(statistic(bench.element, "packets"), 11);
}

ELEMENT_TEST(test_silence_is_said_once) {
  Bench bench("port=0");
  bench.at(10 * ms, at_x(1));
  gst_harness_set_time(bench.harness, 1000 * ms);
  bench.nothing_of({0}, "refused");
  fail_unless_equals_uint64(statistic(bench.element, "silences"), 0);
  gst_harness_set_time(bench.harness, 1020 * ms);
  bench.wait_for("silences", 1);
  gst_harness_set_time(bench.harness, 5000 * ms);
  bench.nothing_of({0}, "refused");
  fail_unless_equals_uint64(statistic(bench.element, "silences"), 1);
  bench.at(6000 * ms, at_x(1));
  gst_harness_set_time(bench.harness, 7010 * ms);
  bench.wait_for("silences", 2);
}

// Motion of constant speed is where it was at the time that the pose has, however much is averaged.
ELEMENT_TEST(test_smoothing_is_latency_and_no_lag) {
  Bench bench("port=0 smoothing=80000000 delay=20000000");
  Came came;
  for (guint64 i = 1; i <= 20; ++i)
    came = bench.at(i * 20 * ms, at_x(0.02 * static_cast<double>(i)));
  fail_unless_equals_uint64(came.time, (400 - 20 - 40) * ms);
  expect_near(came.message.pose.place, {0.36, 0, 0}, 1e-9);  // as it was at 360 ms of arrival
  fail_unless_equals_uint64(latency_of(bench.element), 60 * ms);
  fail_unless(figure(bench.element, "smoothing-lag-ms") == 40.0);
  // Off again, live: the latency's change is told.
  g_object_set(bench.element, "smoothing", guint64{0}, nullptr);
  bench.at(420 * ms, at_x(0.42));
  fail_unless_equals_uint64(bench.at(440 * ms, at_x(0.44)).time, 420 * ms);
  fail_unless_equals_uint64(latency_of(bench.element), 20 * ms);
  GstMessage* message = gst_bus_pop_filtered(bench.bus, GST_MESSAGE_LATENCY);
  fail_unless(message != nullptr);
  gst_message_unref(message);
}

ELEMENT_TEST(test_record_and_replay_are_identical) {
  const std::string file = path("record.pcap");
  const std::string properties = "delay=15000000 smoothing=30000000 ";
  std::vector<Came> live;
  {
    Bench bench("port=0 record=" + file + " " + properties);
    for (guint64 i = 1; i <= 30; ++i) {
      live.push_back(bench.at(
          i * 17 * ms + 3, numbered(static_cast<std::uint16_t>(i), 0.1 * static_cast<double>(i))));
      if (i % 5 == 0) bench.nothing_of({1, 2, 3}, "refused");
    }
    fail_unless_equals_uint64(statistic(bench.element, "recorded"), 36);
  }
  const std::vector<Came> again = played("location=" + file + " " + properties);
  // A pose from before the stream's begin is left out unless it holds there.
  std::size_t kept_from = 0;
  while (kept_from + 1 < live.size() && live[kept_from + 1].time == 0) ++kept_from;
  fail_unless_equals_int(again.size(), live.size() - kept_from);
  for (std::size_t i = 0; i < again.size(); ++i) {
    fail_unless_equals_uint64(again[i].time, live[kept_from + i].time);
    fail_unless(again[i].bytes == live[kept_from + i].bytes);
  }
}

// Packets that wait for up to 15 ms, of a camera that moves by a metre a second.
ELEMENT_TEST(test_what_packets_waited_is_taken_out) {
  const std::string file = path("waited.pcap");
  std::vector<Came> live;
  {
    Bench bench("port=0 record=" + file);
    // The first one waited for nothing.
    for (guint64 i = 0; i < 60; ++i) {
      const GstClockTime taken = i * 20 * ms, waited = i * 7 % 16 * ms;
      live.push_back(
          bench.at(taken + 100 * ms + waited,
                   numbered(static_cast<std::uint16_t>(i), 1e-9 * static_cast<double>(taken),
                            1718806554 * GST_SECOND + taken)));
      const double wanted = live.back().x() * 1e9 + static_cast<double>(100 * ms);
      // What clocks may differ since the last packet that did not wait, .3 s ago at most.
      fail_unless(std::abs(static_cast<double>(live.back().time) - wanted) < 2e-4 * GST_SECOND);
    }
    fail_unless_equals_uint64(statistic(bench.element, "times-unusable"), 0);
    // Who waits for poses must know how late they come.
    fail_unless(std::abs(figure(bench.element, "held-up-ms") - 15.0) < 0.5);
    fail_unless_equals_uint64(latency_of(bench.element), 15 * ms);
    GstMessage* message = gst_bus_pop_filtered(bench.bus, GST_MESSAGE_LATENCY);
    fail_unless(message != nullptr);
    gst_message_unref(message);
    // As they arrive, live.
    gst_util_set_object_arg(G_OBJECT(bench.element), "times", "arrival");
    fail_unless_equals_uint64(
        bench.at(1311 * ms, numbered(60, 1.2, 1718806554 * GST_SECOND + 1200 * ms)).time,
        1311 * ms);
  }
  const std::vector<Came> again = played("location=" + file);
  fail_unless_equals_int(again.size(), live.size() + 1);
  for (std::size_t i = 0; i < live.size(); ++i) {
    fail_unless_equals_uint64(again[i].time, live[i].time);
    fail_unless(again[i].bytes == live[i].bytes);
  }
}

// The pipeline's clock is the sender's.
ELEMENT_TEST(test_times_of_the_clock) {
  Bench bench("port=0 times=clock delay=1000000");
  const GstClockTime base = gst_element_get_base_time(bench.element);
  fail_unless_equals_uint64(bench.at(110 * ms, numbered(1, 0.1, base + 103 * ms)).time, 102 * ms);
  fail_unless_equals_uint64(bench.at(124 * ms, numbered(2, 0.2, base + 123 * ms)).time, 122 * ms);
  fail_unless_equals_uint64(statistic(bench.element, "times-unusable"), 0);
  fail_unless_equals_uint64(bench.at(140 * ms, numbered(3, 0.3)).time, 139 * ms);
  fail_unless_equals_uint64(statistic(bench.element, "times-unusable"), 1);
  bench.expect_one_warning({"PTP", "times=sender"});
}

// As of a sender that tells millimetres; said once.
ELEMENT_TEST(test_places_that_no_stage_has) {
  Bench bench("port=0");
  bench.at(10 * ms, json_bytes(sample({0, 0, 0}, {900, 0, 0})));
  fail_unless_equals_uint64(statistic(bench.element, "places-doubtful"), 0);
  for (guint64 i = 1; i < 3; ++i)
    bench.at((10 + i) * ms, json_bytes(sample({0, 0, 0}, {3000.0 + static_cast<double>(i), 0, 0})));
  fail_unless_equals_uint64(statistic(bench.element, "places-doubtful"), 2);
  const auto said = warnings_on(bench.bus);
  fail_unless_equals_int(said.size(), 1);
  expect_in(said[0], {"3001 m", "millimetres"});
}

ELEMENT_TEST(test_what_is_left_out_is_said) {
  Bench bench("port=0");
  nlohmann::json value = sample({0, 0, 0}, {1, 0, 0});
  value["lens"]["fStop"] = 0;
  value["lens"]["distortion"] = {{{"model", "Fisheye"}, {"radial", {1.0}}}};
  fail_unless(bench.at(10 * ms, json_bytes(value)).x() == 1.0);
  fail_unless_equals_uint64(statistic(bench.element, "values-unread"), 1);
  fail_unless_equals_uint64(statistic(bench.element, "lenses-unread"), 1);
  value["protocol"]["version"] = {2, 0, 0};
  bench.nothing_of(json_bytes(value), "refused");
  const auto said = warnings_on(bench.bus);
  fail_unless_equals_int(said.size(), 3);
  expect_in(said[0], {"127.0.0.1:", "fStop"});
  expect_in(said[1], {"127.0.0.1:", "D-U"});
  expect_in(said[2], {"version 2.0.0, expected 1.x"});
}

ELEMENT_TEST(test_replay_is_sought) {
  const std::string file = recording("sought.pcap", 100);
  GstElement* pipeline = parse("tracksrc location=" + file + " ! appsink name=sink sync=false");
  GstElement* sink = named(pipeline, "sink");
  gst_element_set_state(pipeline, GST_STATE_PAUSED);
  gst_element_get_state(pipeline, nullptr, nullptr, GST_CLOCK_TIME_NONE);
  for (const GstClockTime to : {505 * ms, 0 * ms, 250 * ms, 989 * ms}) {
    fail_unless(gst_element_seek_simple(pipeline, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH,
                                        static_cast<gint64>(to)));
    GstSample* sample = nullptr;
    g_signal_emit_by_name(sink, "pull-preroll", &sample);
    const Came came = came_in(gst_buffer_ref(gst_sample_get_buffer(sample)));
    gst_sample_unref(sample);
    // First comes the one that holds at the time that was sought.
    const GstClockTime holds = to / (10 * ms) * (10 * ms);
    fail_unless_equals_uint64(came.time, holds);
    expect_near({came.x(), 0, 0}, {static_cast<double>(holds) * 1e-9, 0, 0}, 1e-5);
  }
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
}

ELEMENT_TEST(test_damaged_recording_is_used_as_far_as_it_goes) {
  const std::string whole = recording("whole.pcap", 10);
  fail_unless_equals_int(played("location=" + whole).size(), 10);
  std::filesystem::copy_file(whole, path("cut.pcap"),
                             std::filesystem::copy_options::overwrite_existing);
  std::filesystem::resize_file(path("cut.pcap"), std::filesystem::file_size(whole) - 5);
  std::string warning;
  fail_unless_equals_int(played("location=" + path("cut.pcap"), &warning).size(), 9);
  expect_in(warning, {"cut.pcap", "damaged", "truncated"});
}

ELEMENT_TEST(test_full_disk_ends_the_recording_alone) {
  Bench bench("port=0 record=/dev/full");
  bench.at(10 * ms, at_x(1));
  bench.at(20 * ms, at_x(2));
  fail_unless_equals_uint64(statistic(bench.element, "record-failures"), 1);
  bench.expect_one_warning({"/dev/full", "disk is full"});
}

ELEMENT_TEST(test_refusals) {
  Bench bench("port=0");
  expect_in(refusal("port=" + std::to_string(bench.port)),
            {std::to_string(bench.port).c_str(), "in use", "another port"});
  expect_in(refusal("port=0 address=nonsense"), {"nonsense", "IPv4"});
  expect_in(refusal("port=0 address=::1"), {"::1", "IPv4"});
  expect_in(refusal("port=0 address=192.0.2.1"), {"192.0.2.1", "this machine's"});
  expect_in(refusal("port=0 address=239.135.1.1 multicast-iface=nowhere0"),
            {"nowhere0", "multicast-iface"});
  expect_in(refusal("port=0 axes=abc"), {"axes=abc"});
  expect_in(refusal("location=/nowhere/a.pcap"), {"/nowhere/a.pcap"});
  expect_in(refusal("port=0 lens-file=/nowhere/lens.csv"), {"/nowhere/lens.csv", "lens file"});
  std::ofstream(path("lens.csv")) << "zoom focal_length_mm\n0 wide\n";
  expect_in(refusal("port=0 lens-file=" + path("lens.csv")), {"lens.csv, line 2", "'wide'"});
  expect_in(refusal("port=0 record=/nowhere/a.pcap"), {"/nowhere/a.pcap", "recorded"});
  const std::string file = recording("same.pcap", 1);
  expect_in(refusal("location=" + file + " record=" + file), {"same.pcap", "at once"});
  std::ofstream(path("text")) << "this is no recording at all, but text";
  expect_in(refusal("location=" + path("text")), {"text", "no recorded track", "tcpdump"});
  std::ofstream(path("empty"));
  expect_in(refusal("location=" + path("empty")), {"empty", "no recorded track"});
}

ELEMENT_TEST(test_multicast) {
  Bench bench("port=0 address=239.135.1.7 multicast-iface=lo");
  gst_harness_set_time(bench.harness, 10 * ms);
  bench.tracker.send(bench.port, numbered(1, 4.0), "239.135.1.7");
  fail_unless(bench.pull().x() == 4.0);
}

// What came before PLAYING would get a time at which it did not come.
ELEMENT_TEST(test_nothing_stale_after_a_pause) {
  Bench bench("port=0");
  bench.at(10 * ms, at_x(1));
  gst_element_set_state(bench.element, GST_STATE_PAUSED);
  bench.send(at_x(2));
  g_usleep(50000);
  gst_element_set_state(bench.element, GST_STATE_PLAYING);
  const Came came = bench.at(500 * ms, at_x(3));
  fail_unless(came.x() == 3.0, "the pose %g came at %" G_GUINT64_FORMAT, came.x(), came.time);
}

ELEMENT_TEST(test_states) {
  check_states("tracksrc port=0 ! fakesink async=false", 20);
  check_states("tracksrc location=" + recording("states.pcap", 5) + " ! fakesink", 20);
}
