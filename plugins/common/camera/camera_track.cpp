// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/camera/camera_track.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "base/error.h"
#include "scene/timed_announcement.h"

namespace polyhull::element {
namespace {

/// How far a track that is not live may be ahead of the frames.
constexpr std::int64_t most_ahead = GST_SECOND;
/// What is farther away than this, ns, is not of the same run of the timecode.
constexpr std::int64_t near = 2 * GST_SECOND;

/// A message has some hundred bytes.
constexpr gsize largest_message = 65536;

std::int64_t monotonic_ns() {
  return 1000 * g_get_monotonic_time();
}

/// Whether \p track has a pose for \p time, or one that may still stand.
bool covers(const Track& track, std::int64_t time) {
  const auto begin = track.begin(), end = track.end();
  return begin && time >= *begin && time - *end <= Track::silence_ns;
}

}  // namespace

CameraTrack::CameraTrack(GstElement* element, Statistics& statistics,
                         std::function<TrackMatch()> match)
    : element_(element), statistics_(statistics), wanted_match_(std::move(match)) {
  statistics.declare({"poses", "poses-unusable", "frames-tracked", "frames-untracked",
                      "frames-ahead", "track-losses"});
  if (wanted_match_) statistics.declare({"poses-untimed"});
}

/// Of what came under another rule nothing can be said under that of \p moment.
void CameraTrack::follow(const TrackMoment& moment) {
  const bool counted_otherwise = moment.match == TrackMatch::timecode &&
                                 (drops_ ? *drops_ != moment.drops : assumed_ && !moment.drops);
  if (match_ != moment.match) asked_.reset();
  if (match_ != moment.match || counted_otherwise) forget_poses();
  match_ = moment.match;
  period_ = moment.period;
  if (match_ == TrackMatch::timecode) drops_ = moment.drops;
}

/// \p time, which begins at 0 again each day, in a row with what is asked for.
std::int64_t CameraTrack::in_a_row(std::int64_t time) const {
  const auto beside = asked_ ? asked_ : track_.end();
  return beside ? *beside + time_difference(time, *beside, period_) : time;
}

/// The poses among which \p time is; between the two, where the last one before still stands, those.
const Track& CameraTrack::run_of(std::int64_t time) const {
  if (covers(track_, time) || !before_.end()) return track_;
  const bool between = time > *before_.end() && time < track_.begin().value_or(time);
  return between || covers(before_, time) ? before_ : track_;
}

// ---- the element's thread

void CameraTrack::wait_for_pose(Lock& lock, std::int64_t time,
                                std::optional<std::int64_t> longest) {
  const auto known = [&] {
    const Track& run = run_of(time);
    return &run == &before_ || (run.end() && *run.end() >= time);
  };
  // Who is lost is not waited for again with each frame.
  if (longest && lost_) longest = 0;
  const std::int64_t begun = monotonic_ns();
  wait(lock, longest, known);
  if (longest) return;
  while (live_ && !over() && !known()) {
    const std::int64_t left =
        std::max(arrival_, lost_ ? 0 : begun) + Track::silence_ns - monotonic_ns();
    if (left <= 0) return;
    changed_.wait_until(lock, in(left));
  }
}

/// Counts the frame at \p time; the sentence to say where the track has just been lost.
std::optional<std::string> CameraTrack::judge(std::int64_t time) {
  const Track& run = run_of(time);
  const auto end = run.end();
  if (!begun_) begun_ = time;
  // Timecodes may be of another clock altogether.
  const bool early =
      match_ == TrackMatch::timecode && end && *run.begin() - time > Track::silence_ns;
  const bool old = early || time - end.value_or(*begun_) > Track::silence_ns;
  statistics_.count(end && !old ? "frames-tracked" : "frames-untracked");
  if (end && !old && time > *end) statistics_.count("frames-ahead");
  const bool was_lost = lost_;
  lost_ = old;
  if (!old || was_lost) return {};
  if (!end) return "No pose of the tracked camera has come for a second; the properties' is shown.";
  const std::string who = source_.empty() ? "" : " '" + source_ + "'";
  if (match_ == TrackMatch::timecode && monotonic_ns() - arrival_ < Track::silence_ns)
    return fmt::format(
        "By their timecodes the tracked camera{}'s poses are {:.1f} s {} than the frames: the one "
        "nearest is kept. Let both have the same timecode, or look at track-delay.",
        who, 1e-9 * static_cast<double>(early ? *run.begin() - time : time - *end),
        early ? "later" : "earlier");
  return fmt::format(
      "The tracked camera{} has been silent for a second{}: its last pose is kept until it comes "
      "back.",
      who, ended_ ? ", as its track has ended" : "");
}

std::optional<TrackedPose> CameraTrack::at(const TrackMoment& moment,
                                           std::optional<std::int64_t> longest) {
  if (!linked()) return {};
  std::optional<TrackedPose> pose;
  std::optional<std::string> loss;
  {
    Lock lock(mutex_);
    follow(moment);
    const std::int64_t time = in_a_row(moment.time);
    latest_ = time;
    if (!sought_) asked_ = time;
    changed_.notify_all();
    wait_for_pose(lock, time, longest);
    const Track& run = run_of(time);
    if (const auto begin = run.begin()) pose = run.at(std::max(time, *begin));
    loss = judge(time);
  }
  if (loss) statistics_.warn(element_, "track-losses", *loss);
  return pose;
}

void CameraTrack::seek(GstEvent* event) {
  GstSeekFlags flags = GST_SEEK_FLAG_NONE;
  GstFormat format = GST_FORMAT_UNDEFINED;
  gst_event_parse_seek(event, nullptr, &format, &flags, nullptr, nullptr, nullptr, nullptr);
  if (format == GST_FORMAT_TIME && (flags & GST_SEEK_FLAG_FLUSH)) {
    const std::scoped_lock lock(mutex_);
    sought_ = gst_event_get_seqnum(event) != flushed_by_;
  }
  if (!push_upstream(event)) seek_failed();
}

void CameraTrack::seek_failed() {
  const std::scoped_lock lock(mutex_);
  if (!std::exchange(sought_, false)) return;
  asked_ = latest_;
  changed_.notify_all();
}

void CameraTrack::video_flushed(guint32 seek) {
  const std::scoped_lock lock(mutex_);
  if (seek != GST_SEQNUM_INVALID) flushed_by_ = seek;
  sought_ = false;
  asked_.reset();
  latest_.reset();
}

// ---- the track's thread

/// Puts \p message where its timecode says.
void CameraTrack::add_in_a_row(const PoseMessage& message, std::int64_t arrival) {
  if (!message.pose.timecode)
    throw Error(Error::Kind::bad_input,
                "It has no timecode, by which track-match=timecode finds its frame, as FreeD has "
                "none, and OpenTrackIO need not have one. Or set track-match=running-time.");
  const Timecode& timecode = *message.pose.timecode;
  assumed_ = assumed_ || (!drops_ && timecode.can_drop() && !timecode.drops);
  // What counts 29.97 frames per second usually leaves numbers out.
  const auto told = time_of(timecode, drops_.value_or(true));
  if (!told)
    throw Error(Error::Kind::bad_input,
                "Its timecode is one of those that are left out of the count.");
  const std::int64_t time =
      in_a_row(spread_.place(*told, length_of(timecode), arrival)) - message.timecode_lag_ns;
  const auto follows = [&](std::int64_t before) { return time > before && time - before <= near; };
  const auto end = track_.end();
  if (!end || follows(*end)) {
    stray_.reset();
  } else if (stray_ && follows(stray_->time)) {
    before_ = std::exchange(track_, Track({}));
    track_.add(stray_->pose, stray_->time);
    stray_.reset();
  } else {
    stray_ = {time, message.pose};
    return;
  }
  track_.add(message.pose, time);
}

/// Sets \p counter to what counts it where it throws.
void CameraTrack::add(GstBuffer* buffer, TrackMatch match, const char*& counter) {
  const gsize size = gst_buffer_get_size(buffer);
  if (size > largest_message)
    throw Error(Error::Kind::bad_input, "It has {} bytes; at most {} are read.", size,
                largest_message);
  std::string json(size, '\0');
  gst_buffer_extract(buffer, 0, json.data(), size);
  const PoseMessage message = parse_pose_message(json);
  const std::scoped_lock lock(mutex_);
  if (flushing_) return;
  const auto time = running_time(buffer);
  if (!time) throw Error(Error::Kind::bad_input, "It has no time on the pipeline's clock.");
  if (match_ != match) {
    asked_.reset();
    forget_poses();
    match_ = match;
  }
  // Nothing lies between two cameras.
  if (message.pose.source != source_) forget_poses();
  source_ = message.pose.source;
  TrackSettings settings;
  settings.prediction_ns = message.prediction_ns;
  if (match == TrackMatch::timecode) {
    counter = "poses-untimed";
    add_in_a_row(message, *time);
  } else {
    track_.add(message.pose, *time);
  }
  track_.set(settings);
  arrival_ = monotonic_ns();
  changed_.notify_all();
}

bool CameraTrack::is_ahead() const {
  const auto end = track_.end();
  if (match_ == TrackMatch::timecode && !asked_) return true;
  const std::int64_t asked = asked_.value_or(0);
  if (&run_of(asked) == &before_) return *end - *track_.begin() > most_ahead;
  return end && *end > asked + most_ahead;
}

GstFlowReturn CameraTrack::take(Ref<GstBuffer> buffer) {
  const TrackMatch match = match_now();
  {
    Lock lock(mutex_);
    // How the video's timecodes count, and where it is, has to be known first.
    const GstFlowReturn held = hold(lock, [&] { return match == TrackMatch::timecode && !asked_; });
    if (held != GST_FLOW_OK) return held;
  }
  const char* counter = "poses-unusable";
  try {
    add(buffer.get(), match, counter);
    statistics_.count("poses");
  } catch (const std::exception& error) {
    statistics_.warn(element_, counter,
                     fmt::format("A pose at the pad track is not used: {}", error.what()));
  }
  Lock lock(mutex_);
  return hold(lock, [&] { return is_ahead(); });
}

void CameraTrack::forget_poses() {
  track_.forget();
  before_.forget();
  stray_.reset();
  spread_.forget();
  assumed_ = false;
}

void CameraTrack::forget() {
  forget_poses();
  asked_.reset();
  begun_.reset();
  lost_ = false;
}

}  // namespace polyhull::element
