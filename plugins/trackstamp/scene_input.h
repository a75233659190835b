// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The sink pad `scene` of trackstamp: another program's announcements of its camera, lights and
/// scene as lines of JSON (docs/outside-renderers.md), and which of them holds for a frame.
#pragma once

#include <gst/gst.h>

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "plugins/common/statistics.h"
#include "plugins/trackstamp/scene_match.h"
#include "scene/timed_announcement.h"

namespace polyhull::element {

/// Takes what comes at the pad on its streaming thread, and is asked on the element's. Lines that
/// do not come live wait there when they are a second ahead of the frames. Counts scene-messages,
/// scene-messages-unusable, scene-messages-untimed, scene-messages-late, frames-announced,
/// frames-unannounced, scene-losses, and frames-unmatchable.
class SceneInput {
 public:
  /// \p settings gives those of now, from any thread.
  SceneInput(GstElement* element, Statistics& statistics,
             std::function<SceneInputSettings()> settings);
  SceneInput(const SceneInput&) = delete;

  /// A new pad called `scene`, which the caller adds to the element; called once.
  GstPad* make_pad(GstPadTemplate* pad_template);
  bool linked() const { return pad_ != nullptr && gst_pad_is_linked(pad_); }

  /// What holds for \p frame, of \p segment, \p duration ns long (0: not known): the last message
  /// that is at most half a frame later than it; where none is, what held for the frame before;
  /// none where nothing has held yet. Waits until the message for the frame or a later one is there
  /// or no more comes, but at most \p longest ns (none: as long as it takes).
  std::optional<Announcement> at(GstBuffer* frame, const GstSegment& segment, std::int64_t duration,
                                 std::optional<std::int64_t> longest);

  /// Ends waiting, now and from now on, until it is allowed again.
  void unlock(bool unlocked);
  /// Lets lines that come from a file come from its begin again.
  void rewind();
  /// Forgets what held.
  void reset();

 private:
  using Lock = std::unique_lock<std::mutex>;
  static SceneInput& of(GstPad* pad);
  static GstFlowReturn chain(GstPad* pad, GstObject*, GstBuffer* buffer);
  static gboolean event(GstPad* pad, GstObject*, GstEvent* event);
  static gboolean query(GstPad* pad, GstObject* parent, GstQuery* query);
  static gboolean activate(GstPad* pad, GstObject*, GstPadMode mode, gboolean active);

  GstFlowReturn take(GstBuffer* buffer);
  void split(const std::string& bytes, std::optional<std::int64_t> arrival);
  void take_line(const std::string& line, std::optional<std::int64_t> arrival);
  void hear(GstPad* pad, GstEvent* event);
  void forget(bool flushing);
  bool is_ahead() const;
  void follow(SceneMatch match, std::int64_t period);
  std::optional<std::string> judge(const AnnouncementHistory::Entry* entry, std::int64_t time);

  GstElement* element_;
  Statistics& statistics_;
  std::function<SceneInputSettings()> settings_;
  GstPad* pad_ = nullptr;     // the element's
  std::string unfinished_;    // the line that has begun; the pad's thread's, or while that stands
  bool too_long_ = false;     // its begin has been left out
  mutable std::mutex mutex_;  // protects all below; no pad is called with it
  std::condition_variable changed_;
  GstSegment segment_;
  SceneMatch match_ = SceneMatch::timecode;
  std::int64_t period_ = 0;
  AnnouncementHistory history_;
  std::optional<Announcement> current_;
  bool live_ = false, ended_ = false, flushing_ = true, unlocked_ = false;
  std::optional<std::int64_t> asked_;     // the latest frame's time
  std::optional<std::int64_t> answered_;  // the latest's that has gone
  std::optional<std::int64_t> first_;     // the first's, as long as no message has held
  bool lost_ = false;                     // it has been said
};

}  // namespace polyhull::element
