// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// tracksrc: the poses of a tracked camera, from FreeD's or OpenTrackIO's packets over UDP or from a
/// recording of them, one buffer a pose, timed on the pipeline's clock. scenesrc and trackstamp take
/// them at their pads track.
#include <gst/base/gstpushsrc.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "base/error.h"
#include "plugins/common/camera/camera_track.h"
#include "plugins/common/element.h"
#include "plugins/common/guard.h"
#include "plugins/common/live/live_pad.h"
#include "plugins/common/log.h"
#include "plugins/tracksrc/track_input.h"
#include "plugins/tracksrc/udp_socket.h"
#include "track/pose_message.h"

GST_DEBUG_CATEGORY_STATIC(tracksrc_debug);
#define GST_CAT_DEFAULT tracksrc_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

/// How long a look for packets lasts before the tracker's silence is looked at.
constexpr std::int64_t patience_us = 200'000;
constexpr std::int64_t any_time = std::numeric_limits<std::int64_t>::min();

struct TrackSrc {
  static constexpr char type_name[] = "PolyhullTrackSrc";
  static GType base_type() { return GST_TYPE_PUSH_SRC; }
  static void class_init(gpointer klass);

  explicit TrackSrc(gpointer object)
      : element(GST_ELEMENT_CAST(object)), input(element, statistics) {
    gst_base_src_set_format(GST_BASE_SRC(object), GST_FORMAT_TIME);
    gst_base_src_set_live(GST_BASE_SRC(object), TRUE);
  }
  ~TrackSrc() { g_object_unref(cancellable); }

  void open();
  void close();
  void rewind(std::int64_t to);
  std::optional<Datagram> datagram();
  std::optional<TrackInput::Timed> read();
  std::optional<TrackInput::Timed> next();
  void tell_latency(const TrackInputSettings& settings);
  bool stopped() const { return g_cancellable_is_cancelled(cancellable); }

  TrackInputSettings settings;  // under the object lock
  GstElement* element;
  Statistics statistics{"tracksrc-stats"};
  GCancellable* cancellable = g_cancellable_new();
  std::atomic<bool> playing{false};  // the base class goes on asking through a pause
  // From here on the streaming thread's, or of changes of state without one.
  TrackInput input;
  std::unique_ptr<UdpSocket> socket;
  std::unique_ptr<PacketRecording> recording;
  bool ended = false;                          // of the recording
  std::int64_t begin = any_time;               // what comes before is passed over
  std::deque<TrackInput::Timed> ready;         // of the last datagram
  std::optional<TrackInput::Timed> following;  // was read already
  std::int64_t told_latency = 0;
};

void TrackSrc::open() {
  close();
  const TrackInputSettings now = snapshot(element, settings);
  std::error_code error;
  if (!now.location.empty() && std::filesystem::equivalent(now.location, now.record, error))
    throw Error(Error::Kind::bad_input,
                "'{}' cannot be played and recorded to at once. Name another file in record.",
                now.location);
  if (now.location.empty()) {
    socket = std::make_unique<UdpSocket>(now.address, static_cast<std::uint16_t>(now.port),
                                         now.multicast_iface);
  } else {
    recording = std::make_unique<PacketRecording>(now.location);
  }
  statistics.reset();
  const std::uint16_t port = socket ? socket->port() : static_cast<std::uint16_t>(now.port);
  input.open(now, port);
  statistics.set_count("port", socket ? port : 0);
  ended = false;
  begin = any_time;
  told_latency = input.latency(now);
  GST_DEBUG_OBJECT(element, "%s port %u", socket ? "listens on" : "plays a recording of", port);
}

void TrackSrc::close() {
  socket.reset();
  recording.reset();
  ready.clear();
  following.reset();
  input.close();
}

/// Goes to the pose that holds at \p to.
void TrackSrc::rewind(std::int64_t to) {
  recording = std::make_unique<PacketRecording>(snapshot(element, settings).location);
  input.forget();
  ready.clear();
  following.reset();
  ended = false;
  begin = to;
}

/// The next datagram; none: the recording has ended, or nothing came for a while.
std::optional<Datagram> TrackSrc::datagram() {
  if (socket) {
    std::optional<Datagram> came = socket->receive(patience_us, cancellable);
    const std::int64_t time = running_time_now(element);
    if (!playing || time == no_time) return {};
    if (came) came->time_ns = std::max<std::int64_t>(time, 0);
    return came;
  }
  try {
    std::optional<Datagram> came = recording->next();
    ended = !came;
    statistics.set_count("packets-skipped", recording->skipped());
    return came;
  } catch (const Error& error) {
    ended = true;
    statistics.warn(element, "recordings-damaged", error.what());
    return {};
  }
}

/// The next pose; none at the end, or when unlocked.
std::optional<TrackInput::Timed> TrackSrc::read() {
  while (!stopped()) {
    if (!ready.empty()) {
      std::optional<TrackInput::Timed> pose = std::move(ready.front());
      ready.pop_front();
      return pose;
    }
    if (ended) return {};
    const std::optional<Datagram> came = datagram();
    if (came) gst_object_sync_values(GST_OBJECT(element), static_cast<GstClockTime>(came->time_ns));
    // As they are now that it has come.
    const TrackInputSettings settings_now = snapshot(element, settings);
    // Of a recording nobody knows what the clock showed.
    std::optional<std::int64_t> base;
    if (socket) base = static_cast<std::int64_t>(gst_element_get_base_time(element));
    if (came)
      for (TrackInput::Timed& pose : input.take(*came, settings_now, base))
        ready.push_back(std::move(pose));
    tell_latency(settings_now);
    const std::int64_t now = came                ? came->time_ns
                             : socket && playing ? running_time_now(element)
                                                 : no_time;
    if (ready.empty() && now != no_time) input.watch(now);
  }
  return {};
}

std::optional<TrackInput::Timed> TrackSrc::next() {
  if (following) return std::exchange(following, {});
  std::optional<TrackInput::Timed> before;
  while (auto pose = read()) {
    if (pose->time < begin) {
      before = std::move(pose);
      continue;
    }
    if (std::exchange(begin, any_time) == pose->time || !before) return pose;
    following = std::move(pose);
    break;
  }
  return before;
}

void TrackSrc::tell_latency(const TrackInputSettings& now) {
  const std::int64_t latency = input.latency(now);
  if (!socket || std::exchange(told_latency, latency) == latency) return;
  GST_DEBUG_OBJECT(element, "has a latency of %.1f ms now", 1e-6 * static_cast<double>(latency));
  gst_element_post_message(element, gst_message_new_latency(GST_OBJECT(element)));
}

// ---- virtual functions

GstFlowReturn create(GstPushSrc* push, GstBuffer** out) {
  TrackSrc& self = state_of<TrackSrc>(push);
  return guarded(self.element, GST_FLOW_ERROR, [&] {
    const std::optional<TrackInput::Timed> pose = self.next();
    if (self.stopped()) return GST_FLOW_FLUSHING;
    if (!pose) return GST_FLOW_EOS;
    PoseMessage message{pose->pose};
    message.prediction_ns =
        static_cast<std::int64_t>(snapshot(self.element, self.settings).prediction);
    message.timecode_lag_ns = pose->lag;
    const std::string json = pose_message_to_json(message);
    *out = gst_buffer_new_memdup(json.data(), json.size());
    // A pose that was true before the stream began holds at its begin.
    GST_BUFFER_PTS(*out) = static_cast<GstClockTime>(std::max<std::int64_t>(pose->time, 0));
    GST_LOG_OBJECT(push, "pose of %s: %" GST_PTR_FORMAT, pose->pose.source.c_str(), printed(*out));
    return GST_FLOW_OK;
  });
}

gboolean unlock(GstBaseSrc* source) {
  g_cancellable_cancel(state_of<TrackSrc>(source).cancellable);
  return TRUE;
}

gboolean unlock_stop(GstBaseSrc* source) {
  g_cancellable_reset(state_of<TrackSrc>(source).cancellable);
  return TRUE;
}

gboolean is_seekable(GstBaseSrc* source) {
  return state_of<TrackSrc>(source).recording != nullptr;
}

gboolean do_seek(GstBaseSrc* source, GstSegment* segment) {
  TrackSrc& self = state_of<TrackSrc>(source);
  if (segment->format != GST_FORMAT_TIME || segment->rate < 0.0) return FALSE;
  segment->time = segment->start;
  if (!self.recording) return segment->start == 0;
  return guarded(self.element, gboolean{FALSE}, [&]() -> gboolean {
    self.rewind(static_cast<std::int64_t>(segment->position));
    return TRUE;
  });
}

gboolean query(GstBaseSrc* source, GstQuery* query) {
  TrackSrc& self = state_of<TrackSrc>(source);
  if (GST_QUERY_TYPE(query) != GST_QUERY_LATENCY)
    return GST_BASE_SRC_CLASS(parent_class<TrackSrc>())->query(source, query);
  const auto latency =
      static_cast<GstClockTime>(self.input.latency(snapshot(self.element, self.settings)));
  const bool live = gst_base_src_is_live(source);
  gst_query_set_latency(query, live, live ? latency : 0, GST_CLOCK_TIME_NONE);
  return TRUE;
}

GstStateChangeReturn change_state(GstElement* element, GstStateChange transition) {
  TrackSrc& self = state_of<TrackSrc>(element);
  const bool opens = transition == GST_STATE_CHANGE_READY_TO_PAUSED;
  // Here, as after a failure in GstBaseSrc::start the base class would post a second error.
  if (opens) {
    const bool opened = guarded(element, false, [&] {
      self.open();
      return true;
    });
    if (!opened) {
      self.close();
      return GST_STATE_CHANGE_FAILURE;
    }
    gst_base_src_set_live(GST_BASE_SRC(element), self.socket != nullptr);
  }
  // What came while nobody listened would get times at which it did not come.
  if (transition == GST_STATE_CHANGE_PAUSED_TO_PLAYING) {
    guarded(element, 0, [&] {
      if (self.socket) self.socket->drain();
      return 0;
    });
    self.playing = true;
  }
  if (transition == GST_STATE_CHANGE_PLAYING_TO_PAUSED) self.playing = false;
  const GstStateChangeReturn result =
      GST_ELEMENT_CLASS(parent_class<TrackSrc>())->change_state(element, transition);
  if (transition == GST_STATE_CHANGE_PAUSED_TO_READY ||
      (opens && result == GST_STATE_CHANGE_FAILURE))
    self.close();
  return result;
}

void TrackSrc::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(tracksrc_debug, "tracksrc", 0, "poses of a tracked camera");
  add_properties<TrackSrc>(klass, track_input_properties(), &TrackSrc::settings);
  add_statistics<TrackSrc>(
      klass,
      "Counters since the start: packets, poses (taken), bad-checksum, truncated, refused (packets "
      "that are none for another reason), incomplete (samples of which packets never came), late "
      "(packets of samples that were given up), lost (numbers that never came), reordered "
      "(came "
      "after later ones, and were left out), repeated, other-senders (of cameras that are not "
      "followed), times-unusable (sender's times that stood, went back or are not the clock's: the "
      "arrival was taken), values-unread and lenses-unread (values and distortions of lenses that "
      "were left out of a pose), lenses-doubtful (poses whose field of view will not be the "
      "lens's, as the sensor's width, an encoder, a lens file for it or a plausible focal length "
      "is missing), "
      "lenses-outside (poses beyond the rows of the lens file), places-doubtful (poses more than a "
      "kilometre from the tracker's origin), polls (FreeD's messages that tell "
      "no pose), silences (a second without a pose), recorded, record-failures, "
      "packets-skipped "
      "(of a recording, that are no UDP datagrams over IPv4), recordings-damaged, "
      "settings-refused; port (on which it listens); smoothing-lag-ms, by how much later poses "
      "come "
      "for their smoothing; and held-up-ms, by how much later than the quickest they usually "
      "come.");
  set_metadata(klass, "Track source", "Source/Network",
               "Poses of a tracked camera, from FreeD or OpenTrackIO over UDP or from a recording");
  add_template(klass, "src", GST_PAD_SRC, camera_caps);
  GST_ELEMENT_CLASS(klass)->change_state = change_state;
  GstBaseSrcClass* source = GST_BASE_SRC_CLASS(klass);
  source->unlock = unlock;
  source->unlock_stop = unlock_stop;
  source->is_seekable = is_seekable;
  source->do_seek = do_seek;
  source->query = query;
  GST_PUSH_SRC_CLASS(klass)->create = create;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(tracksrc, "tracksrc", GST_RANK_NONE, type_of<TrackSrc>())
