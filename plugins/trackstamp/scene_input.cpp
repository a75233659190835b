// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/trackstamp/scene_input.h"

#include <gst/net/gstnetaddressmeta.h>

#include <utility>

#include "base/error.h"

namespace polyhull::element {
namespace {

/// How far lines that do not come live may be ahead of the frames.
constexpr std::int64_t most_ahead = GST_SECOND;
/// After which a live sender is lost.
constexpr std::int64_t silence = GST_SECOND;
/// A thousand lights have less.
constexpr std::size_t longest_line = 1 << 20;

}  // namespace

SceneInput::SceneInput(GstElement* element, Statistics& statistics,
                       std::function<SceneInputSettings()> settings,
                       std::function<std::optional<std::int64_t>()> video_now)
    : element_(element),
      statistics_(statistics),
      settings_(std::move(settings)),
      video_now_(std::move(video_now)) {
  statistics.declare({"scene-messages", "scene-messages-unusable", "scene-messages-untimed",
                      "scene-messages-late", "frames-announced", "frames-unannounced",
                      "frames-unmatchable", "scene-losses"});
}

void SceneInput::rewind() {
  // Nobody is told where it cannot: what comes over a network goes on.
  push_upstream(gst_event_new_seek(1.0, GST_FORMAT_BYTES, GST_SEEK_FLAG_FLUSH, GST_SEEK_TYPE_SET, 0,
                                   GST_SEEK_TYPE_NONE, -1));
}

void SceneInput::reset() {
  const std::scoped_lock lock(mutex_);
  current_.reset();
}

/// Of what came under another rule nothing can be said under \p match.
void SceneInput::follow(SceneMatch match, std::int64_t period) {
  if (match_ == match && period_ == period) return;
  if (match_ != match) {
    asked_.reset();
    answered_.reset();
    own_before_.reset();
  }
  match_ = match;
  period_ = period;
  history_ = AnnouncementHistory(period);
}

// ---- the element's thread

/// Counts a frame that \p entry is to hold for at \p time; the sentence to say where the sender has
/// just been lost.
std::optional<std::string> SceneInput::judge(const AnnouncementHistory::Entry* entry,
                                             std::int64_t time) {
  if (!first_) first_ = time;
  const std::int64_t age = history_.difference(time, entry != nullptr ? entry->time : *first_);
  // What waits at the pad is there, and is not to hold yet.
  const std::int64_t ahead = history_.last_after(time);
  const bool of_another_time = entry == nullptr && ahead > AnnouncementHistory::near;
  const bool comes = live_ || (video_live_ && (ahead <= 0 || of_another_time));
  const bool old = comes && !ended_ && age > silence;
  statistics_.count(entry != nullptr && !old ? "frames-announced" : "frames-unannounced");
  const bool was_lost = std::exchange(lost_, old);
  if (!old || was_lost) return {};
  const std::string look =
      of_another_time
          ? fmt::format("What waits there holds {:.1f} s later", 1e-9 * static_cast<double>(ahead))
      : begun_ > 0
          ? fmt::format("{} bytes have come without a line feed, with which each message ends",
                        begun_)
          : "See whether the sender is there";
  return fmt::format(
      "At the pad scene no message has come for the frames of the last second{}: what was "
      "announced before is kept. {}, and look at scene-match and scene-delay ({} messages are "
      "known).",
      entry == nullptr ? " or any before" : "", look, history_.size());
}

std::optional<Announcement> SceneInput::at(GstBuffer* frame, const GstSegment& segment,
                                           std::int64_t duration,
                                           std::optional<std::int64_t> longest) {
  if (!linked()) return {};
  const SceneInputSettings settings = settings_();
  const auto own_time = time_of_frame(frame, segment, settings.match);
  if (!own_time) {
    statistics_.warn(element_, "frames-unmatchable",
                     fmt::format("A frame {}; what was announced for the one before is kept. Or "
                                 "match by something else with scene-match.",
                                 missing_in_frames(settings.match)));
    const std::scoped_lock lock(mutex_);
    return current_;
  }
  const bool by_arrival = settings.match == SceneMatch::arrival;
  // Times of sender and video may be rounded otherwise.
  const std::int64_t tolerance = by_arrival ? 0 : duration / 2;
  const std::int64_t time = *own_time - settings.delay;
  std::optional<std::string> loss;
  std::optional<Announcement> found;
  {
    Lock lock(mutex_);
    video_live_ = longest.has_value();
    follow(settings.match, settings.match == SceneMatch::timecode ? period_ : 0);
    asked_ = time + tolerance;
    wanted_ = time - tolerance;
    // Not the delay's: who sets a longer one wants the same messages later.
    if (own_before_ && history_.difference(*own_time, *own_before_) < -AnnouncementHistory::near)
      history_.begin_again(wanted_, run_);
    own_before_ = own_time;
    changed_.notify_all();
    if (!by_arrival) {
      if (longest && lost_) longest = 0;
      wait(lock, longest, [&] { return history_.reaches(wanted_); });
    }
    const auto* entry = history_.at(time + tolerance);
    if (entry != nullptr) {
      current_ = entry->announcement;
      run_ = entry->run;
    }
    loss = judge(entry, time);
    answered_ = asked_;
    found = current_;
  }
  if (loss) statistics_.warn(element_, "scene-losses", *loss);
  if (found && !settings.file.empty()) found->scene = settings.file;
  return found;
}

void SceneInput::video_flushed() {
  const std::scoped_lock lock(mutex_);
  asked_.reset();
  own_before_.reset();
}

// ---- the pad's thread

void SceneInput::take_line(const std::string& line, std::optional<std::int64_t> arrival) {
  const char* counter = "scene-messages-unusable";
  try {
    TimedAnnouncement message = parse_timed_announcement(line);
    counter = "scene-messages-untimed";
    const SceneMatch match = settings_().match;
    std::int64_t period = 0;
    const std::int64_t time = time_of_message(message, match, arrival, period);
    const std::scoped_lock lock(mutex_);
    follow(match, period);
    if (live_ && match != SceneMatch::arrival && answered_ &&
        history_.difference(time, *answered_) <= 0)
      statistics_.count("scene-messages-late");
    history_.add(time, std::move(message.announcement));
    statistics_.count("scene-messages");
    changed_.notify_all();
  } catch (const std::exception& error) {
    statistics_.warn(element_, counter,
                     fmt::format("A message at the pad scene is not used: {}", error.what()));
  }
}

/// Each line waits for itself: one buffer may hold more of them than are kept.
GstFlowReturn SceneInput::split(const std::string& bytes, std::optional<std::int64_t> arrival) {
  std::size_t begin = 0;
  for (std::size_t end; (end = bytes.find('\n', begin)) != std::string::npos; begin = end + 1) {
    unfinished_.append(bytes, begin, end - begin);
    const std::string line = std::exchange(unfinished_, {});
    if (std::exchange(too_long_, false) || line.find_first_not_of(" \t\r") == std::string::npos)
      continue;
    take_line(line, arrival);
    Lock lock(mutex_);
    const GstFlowReturn held = hold(lock, [&] { return is_ahead(); });
    if (held != GST_FLOW_OK) return held;
  }
  unfinished_.append(bytes, begin);
  {
    const std::scoped_lock lock(mutex_);
    begun_ = unfinished_.size();
  }
  if (unfinished_.size() <= longest_line) return GST_FLOW_OK;
  if (!std::exchange(too_long_, true))
    statistics_.warn(element_, "scene-messages-unusable",
                     fmt::format("A line at the pad scene has more than {} bytes and is left out. "
                                 "Each message ends with a line feed.",
                                 longest_line));
  unfinished_.clear();
  return GST_FLOW_OK;
}

/// Never where a frame's message may be the next.
bool SceneInput::is_ahead() const {
  // They hold from when they come.
  if (match_ == SceneMatch::arrival && video_live_) return false;
  if (!asked_)
    return history_.size() > AnnouncementHistory::most / 2 ||
           history_.bytes() > AnnouncementHistory::most_bytes / 2;
  return history_.reaches(wanted_) &&
         (history_.last_after(*asked_) > most_ahead || history_.is_crowded(*asked_));
}

GstFlowReturn SceneInput::take(Ref<GstBuffer> buffer) {
  std::string bytes(gst_buffer_get_size(buffer.get()), '\0');
  gst_buffer_extract(buffer.get(), 0, bytes.data(), bytes.size());
  std::optional<std::int64_t> arrival;
  {
    const std::scoped_lock lock(mutex_);
    if (flushing_) return GST_FLOW_FLUSHING;
    arrival = running_time(buffer.get());
  }
  if (!arrival && settings_().match == SceneMatch::arrival) arrival = video_now_();
  if (gst_buffer_get_net_address_meta(buffer.get()) == nullptr) return split(bytes, arrival);
  // A datagram, whole or not, leaves nothing to the next one.
  end();
  too_long_ = false;
  return split(bytes + "\n", arrival);
}

void SceneInput::begin() {
  unfinished_.clear();
  too_long_ = false;
}

void SceneInput::end() {
  if (!unfinished_.empty()) split("\n", std::nullopt);
}

void SceneInput::forget() {
  history_ = AnnouncementHistory(period_);
  run_ = 0;
  asked_.reset();
  answered_.reset();
  own_before_.reset();
  first_.reset();
  begun_ = 0;
  lost_ = false;
}

}  // namespace polyhull::element
