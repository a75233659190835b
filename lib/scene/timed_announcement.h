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

/// How much later \p a is than \p b, ns; \p period: after which the clock begins at 0 again, as timecodes
/// do each day, so that times are up to half of it before or after each other; 0: never.
std::int64_t time_difference(std::int64_t a, std::int64_t b, std::int64_t period);

/// Announcements by the time from which on each holds, ns on a clock of the caller. Times may jump back
/// or ahead for good, or in a single message that is wrong. Not for several threads at once.
class AnnouncementHistory {
 public:
  static constexpr std::size_t most = 1024;  ///< kept; the one that came first goes
  static constexpr std::size_t most_bytes = std::size_t{32} << 20;  ///< that they have together
  /// What is farther away than this, ns, need not be of the same run of the clock.
  static constexpr std::int64_t near = 2'000'000'000;

  /// \p period as in time_difference().
  explicit AnnouncementHistory(std::int64_t period = 0) : period_(period) {}

  struct Entry {
    std::int64_t time = 0;
    Announcement announcement;
    std::uint64_t run = 0;  ///< how often times had jumped back when it came
    std::size_t bytes = 0;  ///< that it has
  };

  /// Takes \p announcement, in whatever order they come; of two with one time the later counts.
  void add(std::int64_t time, Announcement announcement);

  /// What is asked for has jumped back to \p time, after an entry of \p run: of what came before
  /// messages did or will, too, all that holds from \p time or later on goes.
  void begin_again(std::int64_t time, std::uint64_t run);

  /// The one that holds at \p time: the last that is not later; null: none.
  const Entry* at(std::int64_t time) const;

  /// Whether one is known that holds from \p time on or up to \p near later, or the last two that came
  /// hold from later on: then none can be waited for.
  bool reaches(std::int64_t time) const;

  /// Whether so many came after the one that holds at \p time (all, where none does), half of what is
  /// kept, that it may soon have to go.
  bool is_crowded(std::int64_t time) const;

  /// How much later than \p time the one is that came last; 0: none did.
  std::int64_t last_after(std::int64_t time) const;

  /// How much later \p a is than \p b.
  std::int64_t difference(std::int64_t a, std::int64_t b) const {
    return time_difference(a, b, period_);
  }

  std::size_t size() const { return entries_.size(); }
  std::size_t bytes() const { return bytes_; }

 private:
  template <typename Which>
  void erase(Which which);

  std::int64_t period_;
  std::uint64_t run_ = 0;      // of what comes
  std::deque<Entry> entries_;  // as they came
  std::size_t bytes_ = 0;      // of all
};

}  // namespace polyhull
