// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/track.h"

#include <algorithm>
#include <cstdlib>
#include <glm/gtc/quaternion.hpp>
#include <iterator>

#include "base/error.h"
#include "track/packet_error.h"

namespace polyhull {
namespace {

// So many late numbers one after the other are a sender that began anew.
constexpr int longest_detour = 10;
// Evenly over the time that is smoothed, both ends included: motion of constant speed is late by
// exactly half of it.
constexpr int smoothing_steps = 8;
// A clock that NTP puts right is slowed by up to so much meanwhile.
constexpr double clock_drift = 5e-4;
// A sender's clock that is set back by more puts its poses that far back for good, ns.
constexpr std::int64_t clock_step = 100'000'000;
// Motion is told by poses at least this far apart, ns.
constexpr std::int64_t least_span = 50'000'000;

bool is_same(const TrackedPose& a, const TrackedPose& b) {
  return a.capture_time_ns == b.capture_time_ns && a.place == b.place && a.axes == b.axes;
}

std::optional<double> mean(const std::optional<double>& a, const std::optional<double>& b,
                           double share) {
  if (!a || !b) return share < 0.5 ? a : b;
  return *a + share * (*b - *a);
}

// From \p a (share 0) to \p b (share 1), or beyond. The lens is between the two's, never beyond.
TrackedPose between(const TrackedPose& a, const TrackedPose& b, double share) {
  TrackedPose pose = share < 0.5 ? a : b;
  pose.place = a.place + share * (b.place - a.place);
  pose.axes = glm::mat3_cast(glm::normalize(glm::slerp(
      glm::normalize(glm::quat_cast(a.axes)), glm::normalize(glm::quat_cast(b.axes)), share)));
  share = std::clamp(share, 0.0, 1.0);
  pose.focal_length_mm = mean(a.focal_length_mm, b.focal_length_mm, share);
  pose.focus_distance_m = mean(a.focus_distance_m, b.focus_distance_m, share);
  pose.f_number = mean(a.f_number, b.f_number, share);
  pose.projection_offset_mm =
      a.projection_offset_mm + share * (b.projection_offset_mm - a.projection_offset_mm);
  if (a.distortion.size() == b.distortion.size())
    for (std::size_t i = 0; i < a.distortion.size(); ++i)
      pose.distortion[i] = a.distortion[i] + share * (b.distortion[i] - a.distortion[i]);
  return pose;
}

}  // namespace

Track::Track(TrackSettings settings) {
  set(std::move(settings));
}

void Track::set(TrackSettings settings) {
  if (settings.smoothing_ns < 0 || settings.smoothing_ns > memory_ns || settings.prediction_ns < 0)
    throw Error(Error::Kind::bad_input,
                "A track's smoothing must be between 0 and {} s, its prediction 0 or above.",
                memory_ns / 1'000'000'000);
  settings_ = std::move(settings);
}

void Track::forget() {
  forget_sender();
  sender_.reset();
}

void Track::forget_sender() {
  poses_.clear();
  numbers_move_ = was_silent_ = false;
  left_out_in_a_row_ = 0;
  steady_.reset();
  capture_ns_.reset();
  used_ns_.reset();
  held_up_.reset();
}

std::optional<std::int64_t> Track::begin() const {
  if (poses_.empty()) return {};
  return poses_.front().time;
}

std::optional<std::int64_t> Track::end() const {
  if (poses_.empty()) return {};
  return poses_.back().time;
}

bool Track::follows(const TrackedPose& pose, std::int64_t arrival_ns) {
  const bool silent = sender_ && arrival_ns - heard_ns_ > silence_ns;
  const bool wanted = settings_.source.empty() ? !sender_ || silent || pose.source == *sender_
                                               : pose.source == settings_.source;
  if (!wanted) {
    ++counters_.other_senders;
    return false;
  }
  if (sender_ && *sender_ != pose.source) forget_sender();  // nothing lies between two cameras
  sender_ = pose.source;
  was_silent_ = silent;
  heard_ns_ = arrival_ns;
  return true;
}

/// Whether the one left out with \p sequence follows so many others that this is the order.
bool Track::begins_anew(std::uint16_t sequence) {
  const bool next = left_out_in_a_row_ > 0 && sequence == static_cast<std::uint16_t>(left_out_ + 1);
  left_out_in_a_row_ = next ? left_out_in_a_row_ + 1 : 1;
  left_out_ = sequence;
  return left_out_in_a_row_ > longest_detour;
}

/// The pose of that number among the latest.
const TrackedPose* Track::kept(std::uint16_t sequence) const {
  const auto end =
      poses_.rbegin() + std::min<std::ptrdiff_t>(std::ssize(poses_), furthest_detour + 1);
  const auto found = std::find_if(
      poses_.rbegin(), end, [&](const Timed& before) { return before.pose.sequence == sequence; });
  return found == end ? nullptr : &found->pose;
}

/// Whether \p pose, whose number is lower than the last, is left out, and counted as what it is.
bool Track::left_out(const TrackedPose& pose) {
  const TrackedPose* before = kept(*pose.sequence);
  // Of a sender that is heard on two ways the second may be far behind.
  const bool again = before != nullptr && is_same(*before, pose);
  // Without times a camera that rests looks the same when it begins anew.
  if (again && pose.capture_time_ns) {
    left_out_in_a_row_ = 0;
  } else if (begins_anew(*pose.sequence)) {
    return false;
  }
  ++(again ? counters_.repeated : counters_.reordered);
  if (before == nullptr && counters_.lost > 0) --counters_.lost;
  return true;
}

bool Track::in_order(const TrackedPose& pose) {
  if (poses_.empty() || !pose.sequence || !poses_.back().pose.sequence) return true;
  const TrackedPose& last = poses_.back().pose;
  const int step = static_cast<std::int16_t>(*pose.sequence - *last.sequence);
  numbers_move_ = numbers_move_ || step != 0;
  // Some senders leave the number as it is, and a camera may rest.
  if (step == 0 && numbers_move_ && is_same(pose, last)) {
    ++counters_.repeated;
    return false;
  }
  if (step < 0 && step >= -furthest_detour && !was_silent_ && left_out(pose)) return false;
  left_out_in_a_row_ = 0;
  if (step > 1 && step <= furthest_detour) counters_.lost += static_cast<std::uint64_t>(step - 1);
  return true;
}

std::int64_t Track::unusable_time(std::int64_t arrival_ns) {
  ++counters_.times_unusable;
  steady_.reset();
  return arrival_ns;
}

/// When \p pose, the newest of its sender, was true if none is delayed by more than the quickest.
std::int64_t Track::true_time(const TrackedPose& pose, std::int64_t arrival_ns) {
  if (settings_.times == TrackTimes::arrival || !pose.capture_time_ns) return arrival_ns;
  const std::int64_t capture = *pose.capture_time_ns;
  const bool stands = capture_ns_ == capture;
  capture_ns_ = capture;
  if (stands) return unusable_time(arrival_ns);
  std::int64_t time = 0;
  if (settings_.times == TrackTimes::clock && settings_.clock_begin_ns) {
    const std::int64_t back = used_ns_ ? *used_ns_ - capture : 0;
    // By more both clocks were set.
    if (back > 0 && back < silence_ns) return unusable_time(arrival_ns);
    time = capture - *settings_.clock_begin_ns;
  } else {
    const std::uint64_t restarts = steady_.restarts();
    time =
        steady_.place(capture, arrival_ns, {.settle = 0, .drift = clock_drift, .step = clock_step})
            ->time;
    if (steady_.restarts() != restarts) ++counters_.times_unusable;
  }
  if (std::abs(arrival_ns - time) > silence_ns) return unusable_time(arrival_ns);
  if (settings_.times == TrackTimes::clock) used_ns_ = capture;
  held_up_.add(arrival_ns, std::max<std::int64_t>(0, arrival_ns - time));
  return time;
}

bool Track::add(const TrackedPose& pose, std::int64_t arrival_ns) {
  // What comes late is no measure of when others were true.
  if (!follows(pose, arrival_ns) || !in_order(pose)) return false;
  const std::int64_t time = true_time(pose, arrival_ns) - settings_.delay_ns;
  // Of poses that arrive at once, or under a clock that was set back, the last one holds.
  while (!poses_.empty() && poses_.back().time >= time) poses_.pop_back();
  poses_.push_back({time, pose});
  // The one that held when the memory begins stays, however old.
  while (poses_.size() > most_poses || (poses_.size() > 1 && poses_[1].time < time - 2 * memory_ns))
    poses_.pop_front();
  ++counters_.poses;
  return true;
}

/// Poses that arrive together, as after a delay on the way, tell no speed. So motion is that over a
/// span of some poses, and goes on for no longer than it was seen.
TrackedPose Track::predicted(std::int64_t time_ns) const {
  const std::int64_t span = std::max(least_span, settings_.prediction_ns);
  const Timed& last = poses_.back();
  auto first = std::prev(poses_.end());
  while (first != poses_.begin() && first->time > last.time - span &&
         first->time - std::prev(first)->time <= silence_ns)
    --first;
  const std::int64_t seen = last.time - first->time;
  if (seen == 0) return last.pose;
  const std::int64_t on = std::min({time_ns - last.time, settings_.prediction_ns, seen});
  return between(first->pose, last.pose,
                 static_cast<double>(seen + on) / static_cast<double>(seen));
}

std::optional<TrackedPose> Track::unsmoothed(std::int64_t time_ns) const {
  if (poses_.empty() || time_ns < poses_.front().time) return {};
  const auto after = std::upper_bound(poses_.begin(), poses_.end(), time_ns,
                                      [](std::int64_t t, const Timed& p) { return t < p.time; });
  const Timed& last = poses_.back();
  if (after == poses_.end()) return settings_.prediction_ns == 0 ? last.pose : predicted(time_ns);
  const Timed &a = *std::prev(after), &b = *after;
  // Where the camera was through a silence is not known; it did not begin to move at its start.
  if (b.time - a.time > silence_ns) return a.pose;
  return between(a.pose, b.pose,
                 static_cast<double>(time_ns - a.time) / static_cast<double>(b.time - a.time));
}

std::optional<TrackedPose> Track::at(std::int64_t time_ns) const {
  std::optional<TrackedPose> mean = unsmoothed(time_ns);
  if (!mean || settings_.smoothing_ns == 0) return mean;
  for (int i = 1; i <= smoothing_steps; ++i) {
    const std::int64_t back = settings_.smoothing_ns * i / smoothing_steps;
    // Before the first pose the camera stood where it was first seen.
    const auto next = unsmoothed(std::max(time_ns - back, poses_.front().time));
    mean = between(*mean, *next, 1.0 / (i + 1));
  }
  return mean;
}

}  // namespace polyhull
