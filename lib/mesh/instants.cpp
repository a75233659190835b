// SPDX-License-Identifier: LGPL-2.1-or-later
#include "mesh/instants.h"

#include <algorithm>
#include <cstdlib>

namespace polyhull {
namespace {

constexpr std::int64_t second = 1'000'000'000;
constexpr std::int64_t day = 86'400 * second;
constexpr std::int64_t jump = second;            // what frames' times may differ by without one
constexpr std::int64_t apart = 30 * second;      // that no start and no network explains
constexpr std::int64_t lately = 2 * second;      // a camera that is there
constexpr std::int64_t plausible = 10 * second;  // from the exposure to here
constexpr std::size_t most_bases = 16;

TimeAxis axis_of(CaptureClock clock) {
  switch (clock) {
    case CaptureClock::unix:
      return TimeAxis::unix;
    case CaptureClock::ptp:
      return TimeAxis::ptp;
    default:
      return TimeAxis::pipeline;
  }
}

/// \p value moved by whole days to lie next to \p near.
std::int64_t unwrapped(std::int64_t value, std::int64_t near) {
  const std::int64_t days = (near - value + (near > value ? day / 2 : -day / 2)) / day;
  return value + days * day;
}

}  // namespace

// A view stamped with base time + running time by this very pipeline: the sum says no more than the
// running time, and less where the base time has changed since (after a pause).
bool Instants::is_local(const ViewTimes& times) const {
  return times.capture != no_time && times.clock == CaptureClock::arrival &&
         std::find(bases_.begin(), bases_.end(), times.capture - times.running) != bases_.end();
}

void Instants::note_base(std::int64_t base) {
  if (bases_.back() == base) return;
  pause_ = base - bases_.back();
  if (bases_.size() == most_bases) bases_.erase(bases_.begin() + 1);
  bases_.push_back(base);
}

/// Takes over \p value as the track's; returns by how much it jumped.
std::int64_t Instants::follow(Track& track, const Camera& camera, TimeAxis axis, std::int64_t value,
                              const ViewTimes& times, const ArrivalTimes& now) {
  if (track.axis != axis || !camera.seen) {
    track = {axis, value};
    return 0;
  }
  value += track.correction;
  if (axis == TimeAxis::timecode) value = unwrapped(value, track.value);
  const std::int64_t beyond_running = (value - track.value) - (times.running - camera.running);
  const std::int64_t beyond_arrival = (value - track.value) - (now.monotonic - camera.monotonic);
  // Paused, running time stands still; a camera's clock does not, but a file's does.
  if (pause_ != 0 && std::abs(beyond_running - pause_) < std::abs(beyond_running))
    for (Offset& offset : offsets_)
      if (offset.value != no_time) offset.value += pause_;
  pause_ = 0;
  std::int64_t jumped = 0;
  if (std::abs(beyond_running) > jump && std::abs(beyond_arrival) > jump) {
    jumped = beyond_running;
    value -= jumped;
    track.correction -= jumped;
    // One that jumps back is right again.
    if (std::abs(track.correction) < jump) {
      value -= track.correction;
      track.correction = 0;
    }
  }
  track.value = value;
  return jumped;
}

TimeAxis Instants::common_axis() const {
  bool timecodes = true, clocks = true;
  TimeAxis clock = TimeAxis::running;
  for (const auto& [key, camera] : cameras_) {
    timecodes = timecodes && camera.timecode.axis != TimeAxis::running && !camera.timecode.foreign;
    clocks = clocks && camera.clock.axis != TimeAxis::running && !camera.clock.foreign &&
             (clock == TimeAxis::running || clock == camera.clock.axis);
    clock = camera.clock.axis;
  }
  return timecodes ? TimeAxis::timecode : clocks ? clock : TimeAxis::running;
}

/// Decides where \p axis lies on running time: its \p value is to be placed at \p time.
void Instants::anchor(TimeAxis axis, std::int64_t value, std::int64_t time,
                      const ArrivalTimes& now) {
  Offset& offset = offsets_[static_cast<std::size_t>(axis)];
  if (offset.value != no_time) return;
  offset.value = value - time;
  if (now.running == no_time) return;
  if (axis == TimeAxis::pipeline && std::abs(now.base + now.running - value) < plausible) {
    offset = {now.base, true};
  } else if (axis == TimeAxis::unix && value <= now.unix && now.unix - value < lately) {
    offset.value = now.unix - now.running;
  }
}

std::int64_t Instants::placed(const Camera& camera, TimeAxis axis) const {
  if (axis == TimeAxis::running) return camera.running;
  const Offset& offset = offsets_[static_cast<std::size_t>(axis)];
  const std::int64_t start = offset.of_base ? bases_.back() : offset.value;
  if (axis != TimeAxis::timecode) return camera.clock.value - start;
  return latest_ == no_time ? camera.timecode.value - start
                            : unwrapped(camera.timecode.value - start, latest_);
}

/// Looks whether the first value of \p track can be compared to those of a camera that sends, too;
/// returns that camera where not.
Instants::Key Instants::judge(Key key, Camera& camera, Track& track, const ArrivalTimes& now) {
  if (track.judged || track.axis == TimeAxis::running) return nullptr;
  track.judged = true;
  const bool of_clock = &track == &camera.clock;
  for (const auto& [other_key, other] : cameras_) {
    const Track& theirs = of_clock ? other.clock : other.timecode;
    if (other_key == key || theirs.axis != track.axis || theirs.foreign ||
        now.monotonic - other.monotonic > lately)
      continue;
    const std::int64_t lead = placed(camera, track.axis) - now.monotonic;
    const std::int64_t their_lead = placed(other, track.axis) - other.monotonic;
    track.foreign = std::abs(lead - their_lead) > apart;
    return track.foreign ? other_key : nullptr;
  }
  return nullptr;
}

Instants::Placed Instants::place(Key key, const ViewTimes& times, const ArrivalTimes& now) {
  note_base(now.base);
  Placed result{times.running};
  if (times.running == no_time) return result;
  Camera& camera = cameras_[key];
  const bool local = is_local(times);
  if (local) {
    // Its value is what the running time makes it, with the base time of now. What was found of it
    // beside the others stays.
    const bool foreign = camera.clock.axis == TimeAxis::pipeline && camera.clock.foreign;
    camera.clock = {TimeAxis::pipeline, now.base + times.running, 0, foreign, camera.clock.judged};
    Offset& offset = offsets_[static_cast<std::size_t>(TimeAxis::pipeline)];
    if (offset.value == no_time) offset = {now.base, true};
  } else if (times.capture != no_time) {
    result.jump = follow(camera.clock, camera, axis_of(times.clock), times.capture, times, now);
  } else {
    camera.clock = {};
  }
  if (times.timecode != no_time) {
    const std::int64_t jumped =
        follow(camera.timecode, camera, TimeAxis::timecode, times.timecode, times, now);
    if (result.jump == 0) result.jump = jumped;
  } else {
    camera.timecode = {};
  }
  // Where its axis changes, time goes on.
  const std::int64_t before = camera.seen && camera.axis != TimeAxis::running
                                  ? camera.time + times.running - camera.running
                                  : times.running;
  camera.running = times.running;
  camera.monotonic = now.monotonic;
  camera.seen = true;
  if (camera.clock.axis != TimeAxis::running)
    anchor(camera.clock.axis, camera.clock.value, before, now);
  if (camera.timecode.axis != TimeAxis::running)
    anchor(TimeAxis::timecode, camera.timecode.value, before, now);
  result.apart_from = judge(key, camera, camera.clock, now);
  if (Key other = judge(key, camera, camera.timecode, now)) result.apart_from = other;
  axis_ = common_axis();
  camera.axis = axis_;
  camera.time = result.time = placed(camera, axis_);
  latest_ = result.time;
  return result;
}

}  // namespace polyhull
