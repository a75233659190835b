// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The sink pad `scene` of trackstamp: another program's announcements of its camera, lights and
/// scene as lines of JSON (docs/outside-renderers.md), and which of them holds for a frame.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "plugins/common/live/side_pad.h"
#include "plugins/common/statistics.h"
#include "plugins/trackstamp/scene_match.h"
#include "scene/timed_announcement.h"

namespace polyhull::element {

/// Takes what comes at the pad on its streaming thread, and is asked on the element's. Lines that
/// do not come live wait there when they are a second ahead of the frames. Counts scene-messages,
/// scene-messages-unusable, scene-messages-untimed, scene-messages-late, frames-announced,
/// frames-unannounced, scene-losses, and frames-unmatchable.
class SceneInput final : public SidePad {
 public:
  /// \p settings gives those of now, \p video_now the running time, none where the video is not live:
  /// both from any thread.
  SceneInput(GstElement* element, Statistics& statistics,
             std::function<SceneInputSettings()> settings,
             std::function<std::optional<std::int64_t>()> video_now);

  /// What holds for \p frame, of \p segment, \p duration ns long (0: not known): the last message
  /// that is at most half a frame later than it; where none is, what held for the frame before;
  /// none where nothing has held yet. Waits until the message for the frame or a later one is there
  /// or no more comes, but at most \p longest ns (none: as long as it takes).
  std::optional<Announcement> at(GstBuffer* frame, const GstSegment& segment, std::int64_t duration,
                                 std::optional<std::int64_t> longest);

  /// Lets lines that come from a file come from its begin again.
  void rewind();
  /// The frame to come does not follow the one before.
  void video_flushed();
  /// Forgets what held.
  void reset();

 private:
  GstFlowReturn take(Ref<GstBuffer> buffer) override;
  void begin() override;
  void end() override;
  void forget() override;
  GstFlowReturn split(const std::string& bytes, std::optional<std::int64_t> arrival);
  void take_line(const std::string& line, std::optional<std::int64_t> arrival);
  bool is_ahead() const;
  void follow(SceneMatch match, std::int64_t period);
  std::optional<std::string> judge(const AnnouncementHistory::Entry* entry, std::int64_t time);

  GstElement* element_;
  Statistics& statistics_;
  std::function<SceneInputSettings()> settings_;
  std::function<std::optional<std::int64_t>()> video_now_;
  std::string unfinished_;  // the line that has begun; the pad's thread's, or while that stands
  bool too_long_ = false;   // its begin has been left out
  // Under the lock:
  SceneMatch match_ = SceneMatch::timecode;
  std::int64_t period_ = 0;
  AnnouncementHistory history_;
  std::optional<Announcement> current_;
  std::uint64_t run_ = 0;                   // of the entry that gave it
  std::optional<std::int64_t> asked_;       // the latest frame's time
  std::int64_t wanted_ = 0;                 // from which on it may hold, if asked_
  std::optional<std::int64_t> own_before_;  // the frame's before, without the delay
  std::optional<std::int64_t> answered_;    // the latest's that has gone
  std::optional<std::int64_t> first_;       // the first's, as long as no message has held
  bool lost_ = false;                       // it has been said
  std::size_t begun_ = 0;                   // bytes of the line that has not ended
  bool video_live_ = false;                 // of the latest frame
};

}  // namespace polyhull::element
