// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// One time for what several cameras took at one instant.
///
/// Buffers' running times count from the start of their pipeline: those of branches that were
/// started seconds apart differ by that, and those of cameras by how long each frame took to come.
/// Views say more: a timecode, or a capture time on a clock that several share. Instants places all
/// views by the best of these that every camera has,
///
///     time = value - offset + correction of the camera,
///
/// where the offset is the same for all cameras, so that equal values become equal times, and
/// places them on the running time of the pipeline: in a live stream values of its own clock by its
/// base time and times since 1970 by the machine's, others so that the first view stays where it is.
///
/// A clock that jumps (its time moves by a second more or less than both the running time and the
/// arrival of its frames, and no stall explains it) is corrected for its camera alone. Cameras whose
/// first views, which come together, are half a minute apart, or in a live stream after a second
/// still a second, have clocks that nobody has set to each other: then running times count, as where
/// some camera has neither timecode nor capture time. In a live stream a clock that drifts is found
/// and followed by how its frames' times move beside those at which they come (clock_drifts.h).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "mesh/clock_drifts.h"
#include "mesh/view.h"

namespace polyhull {

/// What a view's instant can be told by, worst first. The clocks' rows are those of CaptureClock.
enum class TimeAxis : std::uint8_t { running, pipeline, unix, ptp, timecode };

/// What is known of a view's instant. All ns, no_time where unknown.
struct ViewTimes {
  std::int64_t running = no_time;  ///< of its buffer
  std::int64_t capture = no_time;
  CaptureClock clock = CaptureClock::arrival;
  std::int64_t timecode = no_time;
};

/// When a view comes. All ns.
struct ArrivalTimes {
  std::int64_t monotonic = 0;      ///< of a clock that nobody sets
  std::int64_t base = 0;           ///< the pipeline clock's time at running time 0
  std::int64_t running = no_time;  ///< now; no_time: not playing
  std::int64_t unix = 0;           ///< the machine's time since 1970
  bool live = false;               ///< views come as they are taken
};

/// For one thread at a time.
class Instants {
 public:
  /// A camera; compared only.
  using Key = const void*;

  /// Two cameras whose clocks nobody has set to each other.
  struct Apart {
    Key from = nullptr;           ///< the other one; null: there is none
    std::int64_t difference = 0;  ///< by how much this camera's views seem to come ahead of its, ns
  };

  struct Placed {
    std::int64_t time = no_time;  ///< on this pipeline's running time; may be negative
    std::int64_t jump = 0;        ///< by how much the camera's clock has just jumped, ns
    Apart apart;                  ///< its clock has just been found not to be another's
    double drift = 0;             ///< its clock has just been found to run so fast, millionths
  };

  /// Places the view \p times of \p camera, which comes at \p now.
  Placed place(Key camera, const ViewTimes& times, const ArrivalTimes& now);

  /// What the last view was placed by.
  TimeAxis axis() const { return axis_; }

  /// Whether the last view of some camera told more of its instant than when it came by the running
  /// time or base time of this pipeline.
  bool any_told() const {
    return std::any_of(cameras_.begin(), cameras_.end(),
                       [](const auto& entry) { return entry.second.told; });
  }

  /// \p camera starts anew.
  void forget(Key camera) {
    cameras_.erase(camera);
    drifts_.forget(camera);
    // After a flush of all, running time begins anew.
    if (!cameras_.empty()) return;
    offsets_ = {};
    latest_ = no_time;
  }
  /// Forgets all cameras but these.
  template <class Cameras>
  void keep_only(const Cameras& cameras) {
    const auto kept = [&](Key camera) {
      return std::find(cameras.begin(), cameras.end(), camera) != cameras.end();
    };
    std::erase_if(cameras_, [&](const auto& entry) { return !kept(entry.first); });
    drifts_.keep_only(kept);
  }
  /// Forgets everything.
  void reset() { *this = Instants(); }

 private:
  static constexpr std::size_t axes = 5;
  /// One camera's clock, or its timecode.
  struct Track {
    TimeAxis axis = TimeAxis::running;  // running: none
    std::int64_t value = no_time;       // the last, corrected
    std::int64_t correction = 0;
    std::int64_t unpaused = 0;  // pauses that the offsets know and its views have not shown yet
    std::int64_t lead = 0;      // value less arrival, of the last view that nothing held up
    std::int64_t since = 0;     // arrival of the first
    bool delayed = false;       // a stall has held views up, and those to come
    bool fractional = false;    // timecodes of 23.976, 29.97, 59.94 … frames/s
    bool foreign = false;       // not comparable to the other cameras'
    bool looked_at = false;     // ... its first value
    bool judged = false;        // ... for good
  };
  struct Camera {
    Track clock, timecode;
    std::int64_t running = 0, monotonic = 0;  // of the last view
    std::int64_t time = no_time;              // where it was placed
    TimeAxis axis = TimeAxis::running;        // by what
    bool seen = false;
    bool told = false;  // as any_told()
  };
  struct Offset {
    std::int64_t value = no_time;
    bool of_base = false;  // the base time, whatever it becomes
  };

  bool is_local(const ViewTimes& times) const;
  /// Takes over the clock and the timecode of a view, with their \p jump; whether its time is is_local().
  bool read_clocks(Camera& camera, const ViewTimes& times, const ArrivalTimes& now,
                   std::int64_t& jump);
  void note_base(std::int64_t base);
  void see_pause(Track& track, std::int64_t beyond_running);
  static bool is_delayed(const Track& track, std::int64_t value, std::int64_t silent,
                         const ArrivalTimes& now);
  std::int64_t follow(Track& track, const Camera& camera, TimeAxis axis, std::int64_t value,
                      const ViewTimes& times, const ArrivalTimes& now);
  TimeAxis common_axis() const;
  void anchor(TimeAxis axis, std::int64_t value, std::int64_t time, const ArrivalTimes& now);
  std::int64_t placed(const Camera& camera, TimeAxis axis) const;
  Apart judge(Key key, const Camera& camera, Track& track, const ArrivalTimes& now);

  std::map<Key, Camera> cameras_;
  ClockDrifts drifts_;  // of live streams
  std::array<Offset, axes> offsets_;
  std::vector<std::int64_t> bases_{0};  // that the pipeline has had, the newest last
  std::int64_t pause_ = 0;  // by how much the base time has moved, and no view has shown it yet
  std::int64_t latest_ = no_time;  // the last time that a view was placed at
  TimeAxis axis_ = TimeAxis::running;
};

}  // namespace polyhull
