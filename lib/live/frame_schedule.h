// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which frame a source of video makes next, and what it leaves out.
///
/// Frame n of a stream of r frames per second has the time n / r, whenever the source was started:
/// so all sources have one grid. One that is late leaves frames out, at frame numbers that its
/// neighbours meet, too.
#pragma once

#include <cstdint>
#include <functional>

#include "live/frame_grid.h"

namespace polyhull {

/// How late each frame leaves, as a real camera's does, ns: delay ± jitter, drawn from seed, but
/// not below 0.
struct FrameDelay {
  std::uint64_t delay = 0, jitter = 0;
  std::uint64_t seed = 0;
  std::int64_t of(std::uint64_t number) const;
};

class FrameSchedule {
 public:
  /// What a source is to make.
  struct Frame {
    std::uint64_t number = 0;
    std::uint64_t time = 0;      ///< of the stream, ns
    std::uint64_t duration = 0;  ///< ns
    std::uint64_t late = 0;      ///< frames before it that were left out because it was too late
    std::uint64_t unwanted = 0;  ///< ... because nobody downstream keeps up with them
  };

  /// Takes the frame rate over, which is above 0; a new one goes on at the same time.
  void set_rate(int numerator, int denominator);

  /// Goes to the frame that is on show at the time \p position, ns.
  void seek(std::uint64_t position);

  /// The frame to make at running time \p now (INT64_MIN: not known, or it may wait).
  /// \p running_time tells that of a frame, ns (INT64_MIN: none), \p delay how late frames leave,
  /// ns, and \p grids which are wanted; null: all.
  Frame next(std::int64_t now, std::uint64_t delay, const FrameGrids* grids,
             const std::function<std::int64_t(std::uint64_t number)>& running_time) const;

  /// Moves on to the one after frame \p number.
  void finish(std::uint64_t number);

  /// Whether no frame has been made yet.
  bool first() const { return first_; }

  /// The time of the stream at which frame \p number begins, ns; the rate is known.
  std::uint64_t time_of(std::uint64_t number) const;

 private:
  std::uint64_t number_at(std::uint64_t time) const;

  int rate_n_ = 0, rate_d_ = 1;
  std::uint64_t next_ = 0;
  std::uint64_t sought_ = 0;  // before the rate was known
  bool first_ = true;
};

}  // namespace polyhull
