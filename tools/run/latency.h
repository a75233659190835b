// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How long a frame takes from the cameras' pictures to the output, and where it spends that time.
/// What belongs to one frame is known by its running time, which all stages keep.
///
/// A frame is followed back from the output: at each element to the input of its instant that came
/// last, up to an element that got nothing of that instant, a camera or decoder. Each element's share
/// is from that input to its output; they add up, with the time between the first camera's picture
/// and the last one's, to the latency. What comes in by a pad `background` is not followed: to wait
/// for it is in the share of who waits.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace polyhull {

/// Of the frames that reached one output, ms.
struct LatencyReport {
  std::size_t frames = 0;
  double minimum = 0.0, median = 0.0, maximum = 0.0, mean = 0.0;
  std::map<std::string, double> shares;  ///< by element, on average over the frames
  double other_cameras = 0.0;     ///< from the first camera's picture to the last, on average
  std::set<std::string> cameras;  ///< where the pictures came from
};

/// Follows buffers. Not for two threads at once.
class LatencyTrace {
 public:
  /// At \p time (seconds of any clock) \p from hands a buffer of running time \p instant (ns) to
  /// \p to, by a pad `background` where \p aside.
  void handed_over(double time, std::int64_t instant, const std::string& from,
                   const std::string& to, bool aside);

  /// The frame \p instant has reached the output \p output, which \p last has handed it to or is.
  void reached(double time, std::int64_t instant, const std::string& output,
               const std::string& last);

  /// What has reached \p output.
  LatencyReport report(const std::string& output) const;

 private:
  struct Handed {
    std::string from, to;
    bool aside;
    double time;
  };
  using Instant = std::vector<Handed>;
  struct Output {
    std::vector<double> latencies;
    std::map<std::string, double> shares;  // sums
    double other_cameras = 0.0;
    std::set<std::string> cameras;
  };
  static std::optional<double> first_picture(const Instant& instant, const std::string& element,
                                             std::set<std::string>& cameras);

  static constexpr std::size_t most_instants = 1000;  // whatever is older has got lost
  std::map<std::int64_t, Instant> instants_;
  std::map<std::string, Output> outputs_;
};

}  // namespace polyhull
