// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The sink pad `track` of an element that needs a tracked camera's pose at the time of each frame.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <optional>
#include <string>

#include "plugins/common/live/side_pad.h"
#include "plugins/common/statistics.h"
#include "track/track.h"

namespace polyhull::element {

inline constexpr char camera_caps[] = "application/x-polyhull-camera";

/// Takes what comes at the pad on its streaming thread, and is asked on the element's. A track that
/// is not live waits there when it is a second ahead of the frames; one that is live never does.
/// Counts poses, poses-unusable, frames-tracked, frames-untracked (without a pose, or with one that
/// is more than a second old), frames-ahead (tracked, but later than the last pose) and track-losses.
class CameraTrack final : public SidePad {
 public:
  CameraTrack(GstElement* element, Statistics& statistics);

  /// The pose at running time \p time, between those that came before and after it. Waits until the
  /// latter is there or the track ends, but at most \p longest ns (none: as long as it takes, of a
  /// live track a second after its last pose). Where none comes the last one stands, and before the
  /// first the first. None where there is no pose at all, or nothing is linked.
  std::optional<TrackedPose> at(std::int64_t time, std::optional<std::int64_t> longest);

 private:
  GstFlowReturn take(BufferRef buffer) override;
  void forget() override;
  void add(GstBuffer* buffer);
  void wait_for_pose(Lock& lock, std::int64_t time, std::optional<std::int64_t> longest);
  std::optional<std::string> judge(std::int64_t time);

  GstElement* element_;
  Statistics& statistics_;
  // Under the lock:
  Track track_{{}};
  std::string source_;
  std::int64_t asked_ = 0;             // the latest frame's time
  std::optional<std::int64_t> begun_;  // the first frame's time
  std::int64_t arrival_ = 0;           // of the last pose, monotonic ns
  bool lost_ = false;                  // it has been said
};

}  // namespace polyhull::element
