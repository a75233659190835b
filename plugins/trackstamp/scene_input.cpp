// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/trackstamp/scene_input.h"

#include <chrono>
#include <utility>

#include "base/error.h"
#include "plugins/common/memory/mapped_memory.h"

namespace polyhull::element {
namespace {

/// How far lines that do not come live may be ahead of the frames.
constexpr std::int64_t most_ahead = GST_SECOND;
/// After which a live sender is lost.
constexpr std::int64_t silence = GST_SECOND;
/// A thousand lights have less.
constexpr std::size_t longest_line = 1 << 20;

std::chrono::steady_clock::time_point deadline_of(std::int64_t ns_from_now) {
  return std::chrono::steady_clock::now() + std::chrono::nanoseconds(ns_from_now);
}

}  // namespace

SceneInput::SceneInput(GstElement* element, Statistics& statistics,
                       std::function<SceneInputSettings()> settings)
    : element_(element), statistics_(statistics), settings_(std::move(settings)) {
  statistics.declare({"scene-messages", "scene-messages-unusable", "scene-messages-untimed",
                      "scene-messages-late", "frames-announced", "frames-unannounced",
                      "frames-unmatchable", "scene-losses"});
  gst_segment_init(&segment_, GST_FORMAT_UNDEFINED);
}

GstPad* SceneInput::make_pad(GstPadTemplate* pad_template) {
  pad_ = gst_pad_new_from_template(pad_template, "scene");
  gst_pad_set_element_private(pad_, this);
  gst_pad_set_chain_function(pad_, chain);
  gst_pad_set_event_function(pad_, event);
  gst_pad_set_query_function(pad_, query);
  gst_pad_set_activatemode_function(pad_, activate);
  return pad_;
}

void SceneInput::unlock(bool unlocked) {
  const std::scoped_lock lock(mutex_);
  unlocked_ = unlocked;
  changed_.notify_all();
}

void SceneInput::rewind() {
  if (!linked()) return;
  // Nobody is told where it cannot: what comes over a network goes on.
  gst_pad_push_event(pad_, gst_event_new_seek(1.0, GST_FORMAT_BYTES, GST_SEEK_FLAG_FLUSH,
                                              GST_SEEK_TYPE_SET, 0, GST_SEEK_TYPE_NONE, -1));
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
  const bool old = live_ && !ended_ && age > silence;
  statistics_.count(entry != nullptr && !old ? "frames-announced" : "frames-unannounced");
  const bool was_lost = std::exchange(lost_, old);
  if (!old || was_lost) return {};
  return fmt::format(
      "At the pad scene no message has come for the frames of the last second{}: what was "
      "announced "
      "before is kept. See whether the sender is there, and look at scene-match and scene-delay "
      "({} messages are known).",
      entry == nullptr ? " or any before" : "", history_.size());
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
    follow(settings.match, settings.match == SceneMatch::timecode ? period_ : 0);
    asked_ = time + tolerance;
    changed_.notify_all();
    const auto known = [&] {
      return flushing_ || unlocked_ || ended_ || history_.reaches(time - tolerance);
    };
    if (!by_arrival) {
      if (longest && lost_) longest = 0;
      if (longest) {
        changed_.wait_until(lock, deadline_of(*longest), known);
      } else {
        // Who is unlinked meanwhile tells nobody, and who turns out to be live is not waited for.
        while (!known() && !live_ && linked()) changed_.wait_until(lock, deadline_of(silence));
      }
    }
    const auto* entry = history_.at(time + tolerance);
    if (entry != nullptr) current_ = entry->announcement;
    loss = judge(entry, time);
    answered_ = asked_;
    found = current_;
  }
  if (loss) statistics_.warn(element_, "scene-losses", *loss);
  if (found && !settings.file.empty()) found->scene = settings.file;
  return found;
}

// ---- the pad's thread

SceneInput& SceneInput::of(GstPad* pad) {
  return *static_cast<SceneInput*>(gst_pad_get_element_private(pad));
}

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

void SceneInput::split(const std::string& bytes, std::optional<std::int64_t> arrival) {
  std::size_t begin = 0;
  for (std::size_t end; (end = bytes.find('\n', begin)) != std::string::npos; begin = end + 1) {
    unfinished_.append(bytes, begin, end - begin);
    const std::string line = std::exchange(unfinished_, {});
    if (!std::exchange(too_long_, false) && line.find_first_not_of(" \t\r") != std::string::npos)
      take_line(line, arrival);
  }
  unfinished_.append(bytes, begin);
  if (unfinished_.size() <= longest_line) return;
  if (!std::exchange(too_long_, true))
    statistics_.warn(element_, "scene-messages-unusable",
                     fmt::format("A line at the pad scene has more than {} bytes and is left out. "
                                 "Each message ends with a line feed.",
                                 longest_line));
  unfinished_.clear();
}

bool SceneInput::is_ahead() const {
  if (!asked_) return history_.size() > AnnouncementHistory::most / 2;
  return history_.later_than(*asked_ + most_ahead) > 0 ||
         history_.later_than(*asked_) > AnnouncementHistory::most / 2;
}

GstFlowReturn SceneInput::take(GstBuffer* buffer) {
  std::string bytes(gst_buffer_get_size(buffer), '\0');
  gst_buffer_extract(buffer, 0, bytes.data(), bytes.size());
  std::optional<std::int64_t> arrival;
  {
    const std::scoped_lock lock(mutex_);
    if (segment_.format == GST_FORMAT_TIME) {
      const GstClockTime time =
          gst_segment_to_running_time(&segment_, GST_FORMAT_TIME, GST_BUFFER_PTS(buffer));
      if (GST_CLOCK_TIME_IS_VALID(time) && time < static_cast<GstClockTime>(G_MAXINT64 / 4))
        arrival = static_cast<std::int64_t>(time);
    }
  }
  split(bytes, arrival);
  Lock lock(mutex_);
  changed_.wait(lock, [&] { return flushing_ || live_ || !is_ahead(); });
  return flushing_ ? GST_FLOW_FLUSHING : GST_FLOW_OK;
}

GstFlowReturn SceneInput::chain(GstPad* pad, GstObject*, GstBuffer* buffer) {
  const BufferRef held(buffer);
  return of(pad).take(buffer);
}

void SceneInput::forget(bool flushing) {
  const std::scoped_lock lock(mutex_);
  flushing_ = flushing;
  live_ = ended_ = false;
  history_ = AnnouncementHistory(period_);
  asked_.reset();
  answered_.reset();
  first_.reset();
  lost_ = false;
  gst_segment_init(&segment_, GST_FORMAT_UNDEFINED);
  changed_.notify_all();
}

void SceneInput::hear(GstPad* pad, GstEvent* event) {
  switch (GST_EVENT_TYPE(event)) {
    case GST_EVENT_FLUSH_START:
      forget(true);
      return;
    case GST_EVENT_FLUSH_STOP:
      unfinished_.clear();
      too_long_ = false;
      forget(false);
      return;
    case GST_EVENT_SEGMENT: {
      g_autoptr(GstQuery) latency = gst_query_new_latency();
      gboolean live = FALSE;
      if (gst_pad_peer_query(pad, latency))
        gst_query_parse_latency(latency, &live, nullptr, nullptr);
      const std::scoped_lock lock(mutex_);
      gst_event_copy_segment(event, &segment_);
      live_ = live;
      ended_ = false;
      changed_.notify_all();
      return;
    }
    case GST_EVENT_EOS: {
      if (!unfinished_.empty()) split("\n", std::nullopt);
      const std::scoped_lock lock(mutex_);
      ended_ = true;
      changed_.notify_all();
      return;
    }
    default:
      return;
  }
}

gboolean SceneInput::event(GstPad* pad, GstObject*, GstEvent* event) {
  of(pad).hear(pad, event);
  gst_event_unref(event);
  return TRUE;
}

/// Nothing of the messages goes on into the stream of frames.
gboolean SceneInput::query(GstPad* pad, GstObject* parent, GstQuery* query) {
  const bool caps =
      GST_QUERY_TYPE(query) == GST_QUERY_CAPS || GST_QUERY_TYPE(query) == GST_QUERY_ACCEPT_CAPS;
  return caps ? gst_pad_query_default(pad, parent, query) : FALSE;
}

gboolean SceneInput::activate(GstPad* pad, GstObject*, GstPadMode mode, gboolean active) {
  if (mode != GST_PAD_MODE_PUSH) return FALSE;
  SceneInput& self = of(pad);
  // The pad's thread is not within it before it is active; after, GStreamer waits for it.
  if (active) {
    self.unfinished_.clear();
    self.too_long_ = false;
  }
  self.forget(!active);
  return TRUE;
}

}  // namespace polyhull::element
