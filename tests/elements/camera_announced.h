// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What tests of tracked cameras share: recordings, poses pushed by hand, and the cameras announced.
#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "../lib/track/packets.h"
#include "element_checks.h"
#include "scene/announcement.h"
#include "track/packet_file.h"
#include "track/pose_message.h"

namespace polyhull::test {

/// A frame as it left: its time, the camera that was announced for it (width 0: none), its bytes.
struct Shown {
  GstClockTime time;
  Camera camera;
  std::vector<std::uint8_t> bytes;
};

/// What goes through a pad: on one streaming thread.
struct CameraLog {
  std::vector<Shown> frames;
  Announcement announced;
};

inline GstPadProbeReturn note_cameras(GstPad*, GstPadProbeInfo* info, gpointer data) {
  CameraLog& log = *static_cast<CameraLog*>(data);
  if (GST_PAD_PROBE_INFO_TYPE(info) & GST_PAD_PROBE_TYPE_BUFFER) {
    GstBuffer* buffer = GST_PAD_PROBE_INFO_BUFFER(info);
    Shown frame{GST_BUFFER_PTS(buffer), log.announced.viewport,
                std::vector<std::uint8_t>(gst_buffer_get_size(buffer))};
    gst_buffer_extract(buffer, 0, frame.bytes.data(), frame.bytes.size());
    log.frames.push_back(std::move(frame));
  } else {
    const GstStructure* said = gst_event_get_structure(GST_PAD_PROBE_INFO_EVENT(info));
    if (said != nullptr && gst_structure_has_name(said, "polyhull-announcement"))
      log.announced = parse_announcement(gst_structure_get_string(said, "json"));
  }
  return GST_PAD_PROBE_OK;
}

inline void log_cameras(GstElement* element, CameraLog& log) {
  GstPad* pad = gst_element_get_static_pad(element, "src");
  gst_pad_add_probe(
      pad,
      static_cast<GstPadProbeType>(GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM),
      note_cameras, &log, nullptr);
  gst_object_unref(pad);
}

/// How often an element has said, since one asked, that its latency is another now.
inline int latencies_told(GstBus* bus) {
  int count = 0;
  while (GstMessage* message = gst_bus_pop_filtered(bus, GST_MESSAGE_LATENCY)) {
    gst_message_unref(message);
    ++count;
  }
  return count;
}

/// Writes OpenTrackIO packets as they come \p step ns apart, with the places and angles given, to
/// \p path; returns that.
inline std::string record_track(const std::filesystem::path& path, std::int64_t step,
                                const std::vector<Vec3>& places, const std::vector<Vec3>& angles) {
  PacketRecorder recorder(path.string(), 55555);
  for (std::size_t i = 0; i < places.size(); ++i) {
    nlohmann::json value = track_examples::sample(angles[i], places[i]);
    value["timing"]["sequenceNumber"] = i;
    value["lens"]["fStop"] = 2.8;
    value["lens"]["focusDistance"] = 2.5;
    value["lens"]["projectionOffset"] = {{"x", 6.0}, {"y", -3.0}};  // a sixth of the picture
    recorder.write(
        {step * static_cast<std::int64_t>(i), 0x7F000001, 4000, track_examples::json_bytes(value)});
  }
  return path.string();
}

/// 1 m along x and 10° of pan a second, a pose every \p step ns, from (0, -3, 0.3) on.
inline std::string record_motion(const std::filesystem::path& path, std::int64_t step, int count) {
  std::vector<Vec3> places, angles;
  for (int i = 0; i < count; ++i) {
    const double seconds = 1e-9 * static_cast<double>(step) * i;
    places.push_back({seconds, -3, 0.3});
    angles.push_back({10 * seconds, 0, 0});
  }
  return record_track(path, step, places, angles);
}

/// Where the camera is in the tracker's world.
inline Vec3 tracked_place(const Camera& camera) {
  const Vec3 c = camera.centre();
  return {c.x, -c.z, c.y};
}

inline void expect_place(const Camera& camera, const Vec3& truth) {
  const Vec3 found = tracked_place(camera);
  fail_unless(glm::length(found - truth) <= 1e-6, "(%.9g %.9g %.9g) is not (%.9g %.9g %.9g)",
              found.x, found.y, found.z, truth.x, truth.y, truth.z);
}

/// The lens of record_track()'s camera, 24.5 mm, as the last announcement tells it.
inline void expect_lens(const CameraLog& log) {
  fail_unless(std::abs(log.announced.aperture - 0.0245 / 2.8) < 1e-12, "aperture %g m",
              log.announced.aperture);
  fail_unless(std::abs(log.announced.focus_distance - 2.5) < 1e-12, "focus at %g m",
              log.announced.focus_distance);
}

/// A pad that pushes poses to an element's pad `track`, or whatever to another, from the test; whether
/// they are of a live source, and how late they come then.
struct PosePusher {
  PosePusher(GstElement* of, bool is_live, GstClockTime late = 0, const char* to = "track")
      : element(of), live(is_live), latency(late), pad(gst_pad_new("poses", GST_PAD_SRC)) {
    track = gst_element_get_static_pad(element, to);
    requested = track == nullptr;
    if (requested) track = gst_element_request_pad_simple(element, to);
    fail_unless(track != nullptr);
    gst_pad_set_element_private(pad, this);
    gst_pad_set_query_function(pad, answer);
    fail_unless(gst_pad_link(pad, track) == GST_PAD_LINK_OK);
  }
  ~PosePusher() {
    gst_pad_set_active(pad, FALSE);
    if (gst_pad_is_linked(pad)) gst_pad_unlink(pad, track);
    if (requested) gst_element_release_request_pad(element, track);
    gst_object_unref(track);
    gst_object_unref(pad);
  }
  PosePusher(const PosePusher&) = delete;
  static gboolean answer(GstPad* pad, GstObject*, GstQuery* query) {
    if (GST_QUERY_TYPE(query) != GST_QUERY_LATENCY) return FALSE;
    const auto* self = static_cast<const PosePusher*>(gst_pad_get_element_private(pad));
    gst_query_set_latency(query, self->live, self->latency, GST_CLOCK_TIME_NONE);
    return TRUE;
  }
  /// Once the element is on its way.
  void begin(const char* format = nullptr) {
    gst_pad_set_active(pad, TRUE);
    GstSegment segment;
    gst_segment_init(&segment, GST_FORMAT_TIME);
    gst_pad_push_event(pad, gst_event_new_stream_start("poses"));
    if (format != nullptr) {
      GstCaps* caps = gst_caps_from_string(format);
      gst_pad_push_event(pad, gst_event_new_caps(caps));
      gst_caps_unref(caps);
    }
    gst_pad_push_event(pad, gst_event_new_segment(&segment));
  }
  GstFlowReturn push(const std::string& text, GstClockTime time) {
    GstBuffer* buffer =
        text.empty() ? gst_buffer_new() : gst_buffer_new_memdup(text.data(), text.size());
    GST_BUFFER_PTS(buffer) = time;
    return gst_pad_push(pad, buffer);
  }
  /// The camera at (\p x, -3, 0.3) in the tracker's world, looking along y.
  GstFlowReturn push(double x, GstClockTime time) {
    PoseMessage message;
    message.pose.place = {x, -3, 0.3};
    return push(pose_message_to_json(message), time);
  }

  GstElement* element;
  bool live;
  GstClockTime latency;
  GstPad* pad;
  GstPad* track = nullptr;
  bool requested = false;
};

/// Poses as from a file: 1 m along x a second, one each 10 ms; a seek, wherever to, is one to the begin.
struct PoseFile : PosePusher {
  explicit PoseFile(GstElement* of) : PosePusher(of, false) {
    gst_pad_set_event_function(pad, seek);
    gst_pad_set_active(pad, TRUE);
    gst_pad_push_event(pad, gst_event_new_stream_start("poses"));
  }
  ~PoseFile() {
    gst_pad_push_event(pad, gst_event_new_flush_start());
    if (thread.joinable()) thread.join();
  }
  void play() {
    GstSegment segment;
    gst_segment_init(&segment, GST_FORMAT_TIME);
    gst_pad_push_event(pad, gst_event_new_segment(&segment));
    pushed = 0;
    thread = std::thread([this] {
      for (int i = 0; i < 100'000 && push(0.01 * i, 10 * GST_MSECOND * i) == GST_FLOW_OK; ++i)
        ++pushed;
    });
  }
  static gboolean seek(GstPad* pad, GstObject*, GstEvent* event) {
    auto* self = static_cast<PoseFile*>(static_cast<PosePusher*>(gst_pad_get_element_private(pad)));
    const bool sought = GST_EVENT_TYPE(event) == GST_EVENT_SEEK;
    gst_event_unref(event);
    if (!sought) return FALSE;
    gst_pad_push_event(pad, gst_event_new_flush_start());
    self->thread.join();
    gst_pad_push_event(pad, gst_event_new_flush_stop(TRUE));
    self->play();
    if (self->afterwards) self->afterwards();
    return TRUE;
  }

  std::thread thread;
  std::atomic<int> pushed{0};
  std::function<void()> afterwards;  // before the seek's answer
};

}  // namespace polyhull::test
