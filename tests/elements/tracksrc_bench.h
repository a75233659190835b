// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What tests of tracksrc share: the element on a clock that they set, and what comes of packets.
#pragma once

#include <gst/check/gstharness.h>
#include <gst/check/gsttestclock.h>

#include <string>

#include "../lib/track/packets.h"
#include "element_checks.h"
#include "support/folder.h"
#include "support/tracker.h"
#include "track/pose_message.h"

namespace polyhull::test {

using namespace polyhull::track_examples;

inline constexpr GstClockTime ms = GST_MSECOND;

/// Of this program.
inline const Folder folder;

/// A pose as it came: its time, its bytes and what they say.
struct Came {
  GstClockTime time = 0;
  std::string bytes;
  PoseMessage message;
  double x() const { return message.pose.place.x; }
};

inline Came came_in(GstBuffer* buffer) {
  Came came;
  came.time = GST_BUFFER_PTS(buffer);
  came.bytes.resize(gst_buffer_get_size(buffer));
  gst_buffer_extract(buffer, 0, came.bytes.data(), came.bytes.size());
  came.message = parse_pose_message(came.bytes);
  gst_buffer_unref(buffer);
  return came;
}

/// tracksrc on a clock that the test sets.
struct Bench {
  explicit Bench(const std::string& properties)
      : harness(gst_harness_new_parse(("tracksrc " + properties).c_str())), bus(gst_bus_new()) {
    gst_harness_use_testclock(harness);
    element = gst_harness_find_element(harness, "tracksrc");
    gst_element_set_bus(element, bus);
    gst_harness_play(harness);
    port = statistic(element, "port");
  }
  ~Bench() {
    gst_element_set_bus(element, nullptr);
    gst_object_unref(bus);
    gst_object_unref(element);
    gst_harness_teardown(harness);
  }

  void send(const Packet& packet, const Tracker& from) { from.send(port, packet); }
  void send(const Packet& packet) { send(packet, tracker); }
  /// Waits until a counter is at \p value.
  void wait_for(const char* counter, guint64 value) {
    for (int i = 0; i < 3000 && statistic(element, counter) < value; ++i) g_usleep(10000);
    fail_unless_equals_uint64(statistic(element, counter), value);
  }
  Came pull() {
    GstBuffer* buffer = gst_harness_pull(harness);
    fail_unless(buffer != nullptr, "no pose came");
    return came_in(buffer);
  }
  /// What comes of \p packet when it arrives at \p time.
  Came at(GstClockTime time, const Packet& packet) {
    gst_harness_set_time(harness, time);
    send(packet);
    return pull();
  }
  /// \p packet brings no pose, and \p counter becomes 1 more.
  void nothing_of(const Packet& packet, const char* counter, const Tracker& from) {
    const guint64 before = statistic(element, counter);
    send(packet, from);
    wait_for(counter, before + 1);
    fail_unless(gst_harness_try_pull(harness) == nullptr);
  }
  void nothing_of(const Packet& packet, const char* counter) {
    nothing_of(packet, counter, tracker);
  }

  /// Of the warnings that came there is one, which has \p parts; returns it.
  std::string expect_one_warning(std::initializer_list<const char*> parts) {
    const std::vector<std::string> said = warnings_on(bus);
    fail_unless_equals_int(said.size(), 1);
    expect_in(said[0], parts);
    return said[0];
  }

  GstHarness* harness;
  GstBus* bus;
  GstElement* element;
  guint64 port = 0;
  Tracker tracker;
};

inline Packet at_x(double x, std::uint8_t camera = 1) {
  return freed(camera, {0, 0, 0}, {x, 0, 0}, 0, 0);
}

inline void expect_near(const Vec3& a, const Vec3& b, double tolerance) {
  fail_unless(glm::length(a - b) <= tolerance, "(%g %g %g) is not (%g %g %g)", a.x, a.y, a.z, b.x,
              b.y, b.z);
}

inline std::string path(const char* name) {
  return folder.file(name);
}

inline std::string refusal(const std::string& properties) {
  GstElement* pipeline = parse("tracksrc " + properties + " ! fakesink");
  std::string said = "it was not refused";
  if (gst_element_set_state(pipeline, GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE)
    said = wait_for_end(pipeline, GST_SECOND);
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
  return said;
}

}  // namespace polyhull::test
