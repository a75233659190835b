// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/camera/camera_track.h"

#include <algorithm>
#include <chrono>

#include "base/error.h"
#include "plugins/common/memory/mapped_memory.h"
#include "track/pose_message.h"

namespace polyhull::element {
namespace {

/// How far a track that is not live may be ahead of the frames.
constexpr std::int64_t most_ahead = GST_SECOND;

/// A message has some hundred bytes.
constexpr gsize largest_message = 65536;

std::int64_t monotonic_ns() {
  return 1000 * g_get_monotonic_time();
}

std::chrono::steady_clock::time_point deadline_of(std::int64_t ns_from_now) {
  return std::chrono::steady_clock::now() + std::chrono::nanoseconds(ns_from_now);
}

}  // namespace

CameraTrack::CameraTrack(GstElement* element, Statistics& statistics)
    : element_(element), statistics_(statistics) {
  statistics.declare({"poses", "poses-unusable", "frames-tracked", "frames-untracked",
                      "frames-ahead", "track-losses"});
  gst_segment_init(&segment_, GST_FORMAT_UNDEFINED);
}

GstPad* CameraTrack::make_pad(GstPadTemplate* pad_template) {
  const std::scoped_lock lock(mutex_);
  if (pad_) return nullptr;
  pad_ = gst_pad_new_from_template(pad_template, "track");
  gst_pad_set_element_private(pad_, this);
  gst_pad_set_chain_function(pad_, chain);
  gst_pad_set_event_function(pad_, event);
  gst_pad_set_query_function(pad_, query);
  gst_pad_set_activatemode_function(pad_, activate);
  return pad_;
}

void CameraTrack::forget_pad() {
  reset(true);
  const std::scoped_lock lock(mutex_);
  pad_ = nullptr;
}

GstPad* CameraTrack::linked_pad() const {
  const std::scoped_lock lock(mutex_);
  if (!pad_ || !gst_pad_is_linked(pad_)) return nullptr;
  return static_cast<GstPad*>(gst_object_ref(pad_));
}

void CameraTrack::unlock(bool unlocked) {
  const std::scoped_lock lock(mutex_);
  unlocked_ = unlocked;
  changed_.notify_all();
}

bool CameraTrack::unlocked() const {
  const std::scoped_lock lock(mutex_);
  return unlocked_;
}

void CameraTrack::push_upstream(GstEvent* event) {
  g_autoptr(GstPad) pad = linked_pad();
  if (pad) {
    gst_pad_push_event(pad, event);
  } else {
    gst_event_unref(event);
  }
}

// ---- the element's thread

bool CameraTrack::wait(std::unique_lock<std::mutex>& lock, std::int64_t time,
                       std::optional<std::int64_t> longest) {
  const auto known = [&] {
    const auto end = track_.end();
    return flushing_ || unlocked_ || ended_ || (end && *end >= time);
  };
  // Who is lost is not waited for again with each frame.
  if (longest && lost_) longest = 0;
  if (longest) return changed_.wait_until(lock, deadline_of(*longest), known);
  const std::int64_t begun = monotonic_ns();
  while (!known()) {
    if (!live_) {
      // Who is unlinked meanwhile tells nobody.
      changed_.wait_until(lock, deadline_of(Track::silence_ns));
      if (!pad_ || !gst_pad_is_linked(pad_)) return false;
      continue;
    }
    const std::int64_t left =
        std::max(arrival_, lost_ ? 0 : begun) + Track::silence_ns - monotonic_ns();
    if (left <= 0) return false;
    changed_.wait_until(lock, deadline_of(left));
  }
  return true;
}

/// Counts the frame at \p time; the sentence to say where the track has just been lost.
std::optional<std::string> CameraTrack::judge(std::int64_t time) {
  const auto end = track_.end();
  if (!begun_) begun_ = time;
  const bool old = time - end.value_or(*begun_) > Track::silence_ns;
  statistics_.count(end && !old ? "frames-tracked" : "frames-untracked");
  if (end && !old && time > *end) statistics_.count("frames-ahead");
  const bool was_lost = lost_;
  lost_ = old;
  if (!old || was_lost) return {};
  if (!end) return "No pose of the tracked camera has come for a second; the properties' is shown.";
  return fmt::format(
      "The tracked camera{} has been silent for a second{}: its last pose is kept until it comes "
      "back.",
      source_.empty() ? "" : " '" + source_ + "'", ended_ ? ", as its track has ended" : "");
}

std::optional<TrackedPose> CameraTrack::at(std::int64_t time, std::optional<std::int64_t> longest) {
  {
    g_autoptr(GstPad) pad = linked_pad();
    if (!pad) return {};
  }
  std::optional<TrackedPose> pose;
  std::optional<std::string> loss;
  {
    std::unique_lock lock(mutex_);
    asked_ = time;
    changed_.notify_all();
    wait(lock, time, longest);
    if (const auto begin = track_.begin()) pose = track_.at(std::max(time, *begin));
    loss = judge(time);
  }
  if (loss) statistics_.warn(element_, "track-losses", *loss);
  return pose;
}

// ---- the track's thread

CameraTrack& CameraTrack::of(GstPad* pad) {
  return *static_cast<CameraTrack*>(gst_pad_get_element_private(pad));
}

void CameraTrack::add(GstBuffer* buffer) {
  const gsize size = gst_buffer_get_size(buffer);
  if (size > largest_message)
    throw Error(Error::Kind::bad_input, "It has {} bytes; at most {} are read.", size,
                largest_message);
  std::string json(size, '\0');
  gst_buffer_extract(buffer, 0, json.data(), size);
  const PoseMessage message = parse_pose_message(json);
  const std::scoped_lock lock(mutex_);
  GstClockTime time = GST_CLOCK_TIME_NONE;
  int sign = 0;
  if (segment_.format == GST_FORMAT_TIME && GST_BUFFER_PTS_IS_VALID(buffer))
    sign =
        gst_segment_to_running_time_full(&segment_, GST_FORMAT_TIME, GST_BUFFER_PTS(buffer), &time);
  if (sign == 0 || time > static_cast<GstClockTime>(G_MAXINT64 / 4))
    throw Error(Error::Kind::bad_input, "It has no time on the pipeline's clock.");
  // Nothing lies between two cameras.
  if (message.pose.source != source_) track_.forget();
  source_ = message.pose.source;
  TrackSettings settings;
  settings.prediction_ns = message.prediction_ns;
  track_.set(settings);
  track_.add(message.pose, sign * static_cast<std::int64_t>(time));
  arrival_ = monotonic_ns();
  changed_.notify_all();
}

GstFlowReturn CameraTrack::take(GstBuffer* buffer) {
  try {
    add(buffer);
    statistics_.count("poses");
  } catch (const std::exception& error) {
    statistics_.warn(element_, "poses-unusable",
                     fmt::format("A pose at the pad track is not used: {}", error.what()));
  }
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] {
    const auto end = track_.end();
    return flushing_ || live_ || !end || *end <= asked_ + most_ahead;
  });
  return flushing_ ? GST_FLOW_FLUSHING : GST_FLOW_OK;
}

GstFlowReturn CameraTrack::chain(GstPad* pad, GstObject*, GstBuffer* buffer) {
  const BufferRef held(buffer);
  return of(pad).take(buffer);
}

void CameraTrack::reset(bool flushing) {
  const std::scoped_lock lock(mutex_);
  flushing_ = flushing;
  live_ = ended_ = false;
  track_.forget();
  asked_ = 0;
  begun_.reset();
  lost_ = false;
  gst_segment_init(&segment_, GST_FORMAT_UNDEFINED);
  changed_.notify_all();
}

void CameraTrack::hear(GstPad* pad, GstEvent* event) {
  switch (GST_EVENT_TYPE(event)) {
    case GST_EVENT_FLUSH_START:
      reset(true);
      return;
    case GST_EVENT_FLUSH_STOP:
      reset(false);
      return;
    case GST_EVENT_SEGMENT: {
      g_autoptr(GstQuery) latency = gst_query_new_latency();
      gboolean live = FALSE;
      if (gst_pad_peer_query(pad, latency))
        gst_query_parse_latency(latency, &live, nullptr, nullptr);
      const std::scoped_lock lock(mutex_);
      gst_event_copy_segment(event, &segment_);
      live_ = live;
      ended_ = false;
      return;
    }
    case GST_EVENT_EOS: {
      const std::scoped_lock lock(mutex_);
      ended_ = true;
      changed_.notify_all();
      return;
    }
    default:
      return;
  }
}

gboolean CameraTrack::event(GstPad* pad, GstObject*, GstEvent* event) {
  of(pad).hear(pad, event);
  gst_event_unref(event);
  return TRUE;
}

/// Nothing of a track goes on into the stream of frames.
gboolean CameraTrack::query(GstPad* pad, GstObject* parent, GstQuery* query) {
  const bool caps =
      GST_QUERY_TYPE(query) == GST_QUERY_CAPS || GST_QUERY_TYPE(query) == GST_QUERY_ACCEPT_CAPS;
  return caps ? gst_pad_query_default(pad, parent, query) : FALSE;
}

gboolean CameraTrack::activate(GstPad* pad, GstObject*, GstPadMode mode, gboolean active) {
  if (mode != GST_PAD_MODE_PUSH) return FALSE;
  of(pad).reset(!active);
  return TRUE;
}

}  // namespace polyhull::element
