// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What another program says of its frames from outside of the pipeline: announcements that tell
/// from which frame on they hold, and which of them holds for a frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>

#include "scene/announcement.h"

namespace polyhull {

/// An announcement and the first frame that it is true for, in as many ways as its sender knows.
struct TimedAnnouncement {
  Announcement announcement;
  std::string timecode;        ///< "hh:mm:ss:ff", ";ff" where frames are dropped; empty: none
  int timecode_numerator = 0;  ///< of the timecode's frames per second
  int timecode_denominator = 1;
  std::optional<std::int64_t> stream_time_ns;  ///< from the begin of the video
  std::optional<std::int64_t> unix_time_ns;    ///< since 1970 UTC, when the frame was taken
};

/// An announcement's JSON with the members `timecode` and `timecode_rate` ([25, 1]),
/// `stream_time_ns`, `unix_time_ns` beside the others, each optional. Throws Error on text that is
/// none. Whether the timecode exists at its rate is not looked at.
TimedAnnouncement parse_timed_announcement(std::string_view json);

/// Announcements by the time from which on each holds, ns on a clock of the caller. Not for several
/// threads at once.
class AnnouncementHistory {
 public:
  static constexpr std::size_t most = 1024;  ///< kept; the one that came first goes

  /// \p period: after which the clock begins at 0 again, as timecodes do each day; 0: never. Times
  /// are then up to half of it before or after each other.
  explicit AnnouncementHistory(std::int64_t period = 0) : period_(period) {}

  struct Entry {
    std::int64_t time = 0;
    Announcement announcement;
  };

  /// Takes \p announcement, in whatever order they come; of two with one time the later counts.
  void add(std::int64_t time, Announcement announcement);

  /// The one that holds at \p time: the last that is not later; null: none.
  const Entry* at(std::int64_t time) const;

  /// Whether one is known that holds from \p time or later on.
  bool reaches(std::int64_t time) const;

  /// How many hold only from a time after \p time on.
  std::size_t later_than(std::int64_t time) const;

  /// How much later \p a is than \p b.
  std::int64_t difference(std::int64_t a, std::int64_t b) const;

  std::size_t size() const { return entries_.size(); }

 private:
  std::int64_t period_;
  std::deque<Entry> entries_;  // as they came
};

}  // namespace polyhull
