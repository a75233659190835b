// SPDX-License-Identifier: LGPL-2.1-or-later
#include "mesh/instants.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "base/nanoseconds.h"

namespace polyhull {
namespace {

constexpr std::int64_t day = 86'400 * second;
// Days of timecodes whose frames are 1.001 of a whole fraction of a second long: those that drop
// numbers keep to the clock but for 86 ms, the others reach midnight 86.4 s late.
constexpr std::int64_t dropping_day = 86'399'913'600'000;
constexpr std::int64_t dragging_day = 86'486'400'000'000;
constexpr std::int64_t jump = second;            // what frames' times may differ by without one
constexpr std::int64_t apart = 30 * second;      // that no start and no network explains
constexpr std::int64_t lately = 2 * second;      // a camera that is there
constexpr std::int64_t plausible = 10 * second;  // from the exposure to here
constexpr std::int64_t beginning = second;       // until what has piled up at a start is through
constexpr std::int64_t most_correction = 2'000'000'000 * second;  // nobody's clock; sums stay sums
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

/// \p value moved by whole days of \p length to lie next to \p near.
std::int64_t unwrapped(std::int64_t value, std::int64_t near, std::int64_t length) {
  const std::int64_t half = near > value ? length / 2 : -length / 2;
  return value + (near - value + half) / length * length;
}

/// The same for a timecode, \p fractional: of 23.976, 29.97, 59.94 … frames/s.
std::int64_t unwrapped_timecode(std::int64_t value, std::int64_t near, bool fractional) {
  if (!fractional) return unwrapped(value, near, day);
  const std::int64_t dropping = unwrapped(value, near, dropping_day);
  const std::int64_t dragging = unwrapped(value, near, dragging_day);
  return std::abs(dropping - near) < std::abs(dragging - near) ? dropping : dragging;
}

/// Whether \p timecode, ns, can be the start of a frame of such a rate: these are multiples of
/// 1001/240000 s, rounded down. Of others' starts one in a thousand is.
bool is_fractional(std::int64_t timecode) {
  constexpr std::int64_t scale = 240, step = 1001 * 1'000'000;
  const std::int64_t beside = timecode * scale % step;
  return beside == 0 || beside >= step - scale;
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
  if (bases_.back() != 0) pause_ += base - bases_.back();  // 0: not started
  if (bases_.size() == most_bases) bases_.erase(bases_.begin() + 1);
  bases_.push_back(base);
}

// Paused, running time stands still; a camera's clock does not, but a file's does. So the first
// view that shows the pause, as its time has moved by it beyond its running time, moves the
// offsets. Views from before the pause may still be on their way then: \p track and the others keep
// what the offsets have moved until they show it, too.
void Instants::see_pause(Track& track, std::int64_t beyond_running) {
  const auto shows = [&](std::int64_t pause) {
    return pause != 0 &&
           std::abs(beyond_running - pause) < std::min(std::abs(beyond_running), jump);
  };
  if (shows(track.unpaused)) {
    track.unpaused = 0;
  } else if (pause_ != 0 && shows(track.unpaused + pause_)) {
    for (Offset& offset : offsets_)
      if (offset.value != no_time) offset.value += pause_;
    for (auto& [key, camera] : cameras_) {
      camera.clock.unpaused += pause_;
      camera.timecode.unpaused += pause_;
    }
    track.unpaused = pause_ = 0;
  }
}

// A stall holds views up: their times go on from where they were while no views came, and whatever
// comes until they are up to date again is no jump either.
bool Instants::is_delayed(const Track& track, std::int64_t value, std::int64_t silent,
                          const ArrivalTimes& now) {
  return value >= track.value && value - now.monotonic <= track.lead + jump &&
         (silent > jump || track.delayed);
}

/// Takes over \p value as the track's; returns by how much it jumped.
std::int64_t Instants::follow(Track& track, const Camera& camera, TimeAxis axis, std::int64_t value,
                              const ViewTimes& times, const ArrivalTimes& now) {
  const bool fractional = axis == TimeAxis::timecode && is_fractional(value);
  if (track.axis != axis || !camera.seen || std::abs(track.correction) > most_correction) {
    track = {axis, value};
    track.fractional = fractional;
    track.lead = value - now.monotonic;
    track.since = now.monotonic;
    return 0;
  }
  track.fractional = track.fractional && fractional;
  value += track.correction;
  if (axis == TimeAxis::timecode) value = unwrapped_timecode(value, track.value, track.fractional);
  const std::int64_t beyond_running = (value - track.value) - (times.running - camera.running);
  const std::int64_t silent = now.monotonic - camera.monotonic;
  const std::int64_t beyond_arrival = (value - track.value) - silent;
  see_pause(track, beyond_running);
  std::int64_t jumped = 0;
  if (std::abs(beyond_running) > jump && std::abs(beyond_arrival) > jump &&
      !is_delayed(track, value, silent, now)) {
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
  const std::int64_t lead = value - now.monotonic;
  track.delayed = lead < track.lead - jump && (track.delayed || silent > jump);
  if (!track.delayed) track.lead = lead;
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
  // What is not live was taken at another time, with another start of the clocks.
  if (now.running == no_time || !now.live) return;
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
  if (axis != TimeAxis::timecode) return camera.clock.value + camera.clock.unpaused - start;
  const Track& track = camera.timecode;
  const std::int64_t time = track.value + track.unpaused - start;
  return latest_ == no_time ? time : unwrapped_timecode(time, latest_, track.fractional);
}

// Nothing explains half a minute. In a live stream clocks that are seconds apart are no less
// useless, but a start may explain them, or what has piled up before it: they are looked at once
// that is through. Files come as fast as they are read, which says nothing.
Instants::Apart Instants::judge(Key key, const Camera& camera, Track& track,
                                const ArrivalTimes& now) {
  if (track.judged || track.axis == TimeAxis::running) return {};
  const bool first = !std::exchange(track.looked_at, true);
  if (!first && !now.live) return {};
  track.judged = now.live && now.monotonic - track.since >= beginning;
  const std::int64_t limit = track.judged ? jump : apart;
  const bool of_clock = &track == &camera.clock;
  for (const auto& [other_key, other] : cameras_) {
    const Track& theirs = of_clock ? other.clock : other.timecode;
    if (other_key == key || theirs.axis != track.axis || theirs.foreign || track.foreign ||
        now.monotonic - other.monotonic > lately)
      continue;
    const std::int64_t lead = placed(camera, track.axis) - now.monotonic;
    const std::int64_t difference = lead - (placed(other, track.axis) - other.monotonic);
    track.foreign = std::abs(difference) > limit;
    return track.foreign ? Apart{other_key, difference} : Apart{};
  }
  return {};
}

bool Instants::read_clocks(Camera& camera, const ViewTimes& times, const ArrivalTimes& now,
                           std::int64_t& jump) {
  // Frames of files that came before the clock ran: a take has them, and where it was recorded is
  // told by those that follow.
  const bool before_clock =
      !now.live && times.clock == CaptureClock::arrival && times.capture == times.running;
  const bool local = !before_clock && is_local(times);
  camera.told = (times.capture != no_time && !before_clock && !local) || times.timecode != no_time;
  if (before_clock) {
    camera.clock = {};
  } else if (local) {
    // Its value is what the running time makes it, with the base time of now. What was found of it
    // beside the others stays.
    if (camera.clock.axis != TimeAxis::pipeline) {
      camera.clock = {TimeAxis::pipeline};
      camera.clock.since = now.monotonic;
    }
    camera.clock.value = now.base + times.running;
    camera.clock.lead = camera.clock.value - now.monotonic;
    camera.clock.correction = camera.clock.unpaused = 0;
    Offset& offset = offsets_[static_cast<std::size_t>(TimeAxis::pipeline)];
    if (offset.value == no_time) offset = {now.base, true};
  } else if (times.capture != no_time) {
    jump = follow(camera.clock, camera, axis_of(times.clock), times.capture, times, now);
  } else {
    camera.clock = {};
  }
  if (times.timecode != no_time) {
    const std::int64_t jumped =
        follow(camera.timecode, camera, TimeAxis::timecode, times.timecode, times, now);
    if (jump == 0) jump = jumped;
  } else {
    camera.timecode = {};
  }
  return local;
}

Instants::Placed Instants::place(Key key, const ViewTimes& times, const ArrivalTimes& now) {
  note_base(now.base);
  Placed result{times.running};
  if (times.running == no_time) return result;
  Camera& camera = cameras_[key];
  const bool local = read_clocks(camera, times, now, result.jump);
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
  result.apart = judge(key, camera, camera.clock, now);
  if (const Apart found = judge(key, camera, camera.timecode, now); found.from != nullptr)
    result.apart = found;
  if (now.live && camera.clock.axis != TimeAxis::running && !camera.clock.delayed)
    result.drift = drifts_.note(key, camera.clock.value, now.monotonic);
  // Frames stamped when they came, by this pipeline's clock, show only how they came.
  if (local) result.drift = 0;
  axis_ = common_axis();
  camera.axis = axis_;
  result.time = placed(camera, axis_);
  const bool by_clock = axis_ != TimeAxis::running && axis_ != TimeAxis::timecode;
  if (by_clock && !local) result.time -= drifts_.gained(key, now.monotonic);
  camera.time = result.time;
  latest_ = result.time;
  return result;
}

}  // namespace polyhull
