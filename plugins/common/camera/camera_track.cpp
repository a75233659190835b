// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/camera/camera_track.h"

#include <algorithm>

#include "base/error.h"
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

}  // namespace

CameraTrack::CameraTrack(GstElement* element, Statistics& statistics)
    : element_(element), statistics_(statistics) {
  statistics.declare({"poses", "poses-unusable", "frames-tracked", "frames-untracked",
                      "frames-ahead", "track-losses"});
}

// ---- the element's thread

void CameraTrack::wait_for_pose(Lock& lock, std::int64_t time,
                                std::optional<std::int64_t> longest) {
  const auto known = [&] {
    const auto end = track_.end();
    return end && *end >= time;
  };
  // Who is lost is not waited for again with each frame.
  if (longest && lost_) longest = 0;
  const std::int64_t begun = monotonic_ns();
  wait(lock, longest, known);
  if (longest) return;
  while (live_ && !over() && !known()) {
    const std::int64_t left =
        std::max(arrival_, lost_ ? 0 : begun) + Track::silence_ns - monotonic_ns();
    if (left <= 0) return;
    changed_.wait_until(lock, in(left));
  }
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
  if (!linked()) return {};
  std::optional<TrackedPose> pose;
  std::optional<std::string> loss;
  {
    Lock lock(mutex_);
    asked_ = time;
    changed_.notify_all();
    wait_for_pose(lock, time, longest);
    if (const auto begin = track_.begin()) pose = track_.at(std::max(time, *begin));
    loss = judge(time);
  }
  if (loss) statistics_.warn(element_, "track-losses", *loss);
  return pose;
}

// ---- the track's thread

void CameraTrack::add(GstBuffer* buffer) {
  const gsize size = gst_buffer_get_size(buffer);
  if (size > largest_message)
    throw Error(Error::Kind::bad_input, "It has {} bytes; at most {} are read.", size,
                largest_message);
  std::string json(size, '\0');
  gst_buffer_extract(buffer, 0, json.data(), size);
  const PoseMessage message = parse_pose_message(json);
  const std::scoped_lock lock(mutex_);
  if (flushing_) return;
  const auto time = running_time(buffer);
  if (!time) throw Error(Error::Kind::bad_input, "It has no time on the pipeline's clock.");
  // Nothing lies between two cameras.
  if (message.pose.source != source_) track_.forget();
  source_ = message.pose.source;
  TrackSettings settings;
  settings.prediction_ns = message.prediction_ns;
  track_.set(settings);
  track_.add(message.pose, *time);
  arrival_ = monotonic_ns();
  changed_.notify_all();
}

GstFlowReturn CameraTrack::take(BufferRef buffer) {
  try {
    add(buffer.get());
    statistics_.count("poses");
  } catch (const std::exception& error) {
    statistics_.warn(element_, "poses-unusable",
                     fmt::format("A pose at the pad track is not used: {}", error.what()));
  }
  Lock lock(mutex_);
  return hold(lock, [&] {
    const auto end = track_.end();
    return end && *end > asked_ + most_ahead;
  });
}

void CameraTrack::forget() {
  track_.forget();
  asked_ = 0;
  begun_.reset();
  lost_ = false;
}

}  // namespace polyhull::element
