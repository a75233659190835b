// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How many frames of a live stream a stage takes on, found by trying.
///
/// A stage that cannot keep up loses instants: they come too late, or single cameras leave them
/// out. Losing them at the end costs all the work that was done for them, and leaves an uneven
/// rhythm. So where more than one in five is lost, every second frame is asked for from then on,
/// then every fourth and so on, up to every sixteenth. After a time with few losses twice as many
/// are tried; a trial that fails within 3 s doubles the time until the next one (2 s to 16 s), so
/// that what cannot be done is not tried all the time.
#pragma once

#include <cstdint>

namespace polyhull {

class Pace {
 public:
  /// Notes that the wanted instant \p time (running time, ns, rising) was \p lost or not. True:
  /// step() has changed.
  bool note(std::int64_t time, bool lost);

  /// Every step()-th frame is wanted: a power of two, at most 16.
  int step() const { return step_; }

  /// As at the start: the first second is not judged.
  void reset() { *this = Pace(); }

 private:
  static constexpr int largest_step = 16;
  void start_counting(std::int64_t time);

  int step_ = 1;
  bool started_ = false;
  std::int64_t begin_ = 0;   // of what is counted
  std::int64_t clean_ = 0;   // since then no more than a few were lost
  std::int64_t trial_ = -1;  // when the last trial began, -1: none that may still fail
  std::int64_t patience_ = 2'000'000'000;
  int instants_ = 0, lost_ = 0;
};

}  // namespace polyhull
