// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The sink pad `track` of an element that needs a tracked camera's pose at the time of each frame.
#pragma once

#include <gst/gst.h>

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "plugins/common/statistics.h"
#include "track/track.h"

namespace polyhull::element {

inline constexpr char camera_caps[] = "application/x-polyhull-camera";

/// Takes what comes at the pad on its streaming thread, and is asked on the element's. A track that
/// is not live waits there when it is a second ahead of the frames; one that is live never does.
/// Counts poses, poses-unusable, frames-tracked, frames-untracked (without a pose, or with one that
/// is more than a second old), frames-ahead (tracked, but later than the last pose) and track-losses.
class CameraTrack {
 public:
  CameraTrack(GstElement* element, Statistics& statistics);
  CameraTrack(const CameraTrack&) = delete;

  /// A new pad called `track`, which the caller adds to the element; null where there is one already.
  GstPad* make_pad(GstPadTemplate* pad_template);
  /// The element has removed the pad.
  void forget_pad();
  /// A reference on the pad; null where there is none, or nothing is linked to it.
  GstPad* linked_pad() const;

  /// The pose at running time \p time, between those that came before and after it. Waits until the
  /// latter is there or the track ends, but at most \p longest ns (none: as long as it takes, of a
  /// live track a second after its last pose). Where none comes the last one stands, and before the
  /// first the first. None where there is no pose at all, or nothing is linked.
  std::optional<TrackedPose> at(std::int64_t time, std::optional<std::int64_t> longest);

  /// Ends waiting, now and from now on, until it is allowed again.
  void unlock(bool unlocked);
  bool unlocked() const;
  /// Passes an event that goes upstream on to where the track comes from; takes the reference.
  void push_upstream(GstEvent* event);

 private:
  static CameraTrack& of(GstPad* pad);
  static GstFlowReturn chain(GstPad* pad, GstObject*, GstBuffer* buffer);
  static gboolean event(GstPad* pad, GstObject*, GstEvent* event);
  static gboolean query(GstPad* pad, GstObject* parent, GstQuery* query);
  static gboolean activate(GstPad* pad, GstObject*, GstPadMode mode, gboolean active);

  GstFlowReturn take(GstBuffer* buffer);
  void add(GstBuffer* buffer);
  void hear(GstPad* pad, GstEvent* event);
  void reset(bool flushing);
  bool wait(std::unique_lock<std::mutex>& lock, std::int64_t time,
            std::optional<std::int64_t> longest);
  std::optional<std::string> judge(std::int64_t time);

  GstElement* element_;
  Statistics& statistics_;
  mutable std::mutex mutex_;  // protects all below; no pad is called with it
  std::condition_variable changed_;
  GstPad* pad_ = nullptr;  // the element's
  GstSegment segment_;
  Track track_{{}};
  std::string source_;
  bool live_ = false, ended_ = false, flushing_ = true, unlocked_ = false;
  std::int64_t asked_ = 0;             // the latest frame's time
  std::optional<std::int64_t> begun_;  // the first frame's time
  std::int64_t arrival_ = 0;           // of the last pose, monotonic ns
  bool lost_ = false;                  // it has been said
};

}  // namespace polyhull::element
