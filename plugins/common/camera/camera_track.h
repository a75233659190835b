// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The sink pad `track` of an element that needs a tracked camera's pose at the time of each frame.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "plugins/common/live/side_pad.h"
#include "plugins/common/statistics.h"
#include "track/pose_message.h"
#include "track/track.h"

namespace polyhull::element {

inline constexpr char camera_caps[] = "application/x-polyhull-camera";

/// By what poses and frames find each other.
enum class TrackMatch {
  running_time,
  timecode,
};

/// The time of a frame by which its pose is asked for, ns.
struct TrackMoment {
  std::int64_t time = 0;
  TrackMatch match = TrackMatch::running_time;
  std::int64_t period = 0;  ///< of timecodes: a day of the video's (time_difference())
  bool drops = false;       ///< whether the video's leave numbers out
};

/// Takes what comes at the pad on its streaming thread, and is asked on the element's. A track that
/// is not live waits there when it is a second ahead of the frames; one that is live never does.
/// Counts poses, poses-unusable, poses-untimed, frames-tracked, frames-untracked (without a pose, or
/// with one that is more than a second away), frames-ahead (tracked, but later than the last pose) and
/// track-losses.
///
/// By timecode the poses' times are put in a row that midnight does not break. Timecodes may jump: a
/// pose that does not follow counts once the next one follows it, and of the poses of before the jump
/// the frames of before it still find theirs.
class CameraTrack final : public SidePad {
 public:
  /// \p match gives that of now, from any thread; without one it is by running time.
  CameraTrack(GstElement* element, Statistics& statistics, std::function<TrackMatch()> match = {});

  /// The pose at \p moment, between those that came before and after it. Waits until the
  /// latter is there or the track ends, but at most \p longest ns (none: as long as it takes, of a
  /// live track a second after its last pose). Where none comes the last one stands, and before the
  /// first the first. None where there is no pose at all, or nothing is linked.
  std::optional<TrackedPose> at(const TrackMoment& moment, std::optional<std::int64_t> longest);

  /// Takes the track along; takes the reference. Frames that are asked for until video_flushed(), or
  /// until \p event has led nowhere with the video, are of before: the track does not follow them.
  void seek(GstEvent* event);
  void seek_failed();
  /// The frame to come does not follow the one before. \p seek: the number of the seek that flushed; the
  /// same one may come again, once from each sink, and flushes no more.
  void video_flushed(guint32 seek = GST_SEQNUM_INVALID);

 private:
  GstFlowReturn take(Ref<GstBuffer> buffer) override;
  void forget() override;
  void forget_poses();
  TrackMatch match_now() const {
    return wanted_match_ ? wanted_match_() : TrackMatch::running_time;
  }
  void follow(const TrackMoment& moment);
  void add(GstBuffer* buffer, TrackMatch match, const char*& counter);
  void add_in_a_row(const PoseMessage& message, std::int64_t arrival);
  std::int64_t in_a_row(std::int64_t time) const;
  const Track& run_of(std::int64_t time) const;
  bool is_ahead() const;
  void wait_for_pose(Lock& lock, std::int64_t time, std::optional<std::int64_t> longest);
  std::optional<std::string> judge(std::int64_t time);

  struct Timed {
    std::int64_t time;
    TrackedPose pose;
  };
  GstElement* element_;
  Statistics& statistics_;
  std::function<TrackMatch()> wanted_match_;
  // Under the lock:
  TrackMatch match_ = TrackMatch::running_time;  // by which all below is
  Track track_{{}};
  Track before_{{}};            // until its timecode jumped
  std::optional<Timed> stray_;  // the last one that did not follow
  TimecodeSpread spread_;
  std::int64_t period_ = 0;
  std::optional<bool> drops_;  // of the video; none: no frame has told
  bool assumed_ = false;       // before it did, that it does
  std::string source_;
  std::optional<std::int64_t> asked_;   // the latest frame's time that the track follows
  std::optional<std::int64_t> latest_;  // the latest frame's
  bool sought_ = false;                 // frames to come are of before the seek
  guint32 flushed_by_ = GST_SEQNUM_INVALID;
  std::optional<std::int64_t> begun_;  // the first frame's time
  std::int64_t arrival_ = 0;           // of the last pose, monotonic ns
  bool lost_ = false;                  // it has been said
};

}  // namespace polyhull::element
