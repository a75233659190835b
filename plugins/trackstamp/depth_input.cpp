// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/trackstamp/depth_input.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <utility>

#include "plugins/common/memory/video_frame.h"

namespace polyhull::element {
namespace {

/// Frames that wait: of files until they are asked for, live ones until later ones have come.
constexpr std::size_t most_of_files = 4, most_live = 64;
/// What live ones may have together: 15 of 2160p. A decoder may have lent them.
constexpr std::size_t most_bytes = std::size_t{256} << 20;
/// What is farther away need not be of the same run of the clock.
constexpr std::int64_t soon = GST_SECOND;
/// Frames whose times are further apart follow a jump, which is no silence.
constexpr std::int64_t longest_step = 2 * GST_SECOND;

/// 65535 is \p near metres away, v is 65535 near / v, and 0 is nothing.
std::shared_ptr<const DepthPicture> picture_of(const GstVideoInfo& info, GstBuffer* buffer,
                                               double near) {
  const MappedFrame frame(info, buffer, GST_MAP_READ);
  auto picture = std::make_shared<DepthPicture>();
  picture->width = GST_VIDEO_INFO_WIDTH(&info);
  picture->height = GST_VIDEO_INFO_HEIGHT(&info);
  picture->inverse.resize(static_cast<std::size_t>(picture->width) *
                          static_cast<std::size_t>(picture->height));
  const bool big = GST_VIDEO_INFO_FORMAT(&info) == GST_VIDEO_FORMAT_GRAY16_BE;
  const float each = static_cast<float>(1.0 / (65535.0 * near));
  float* to = picture->inverse.data();
  for (int y = 0; y < picture->height; ++y) {
    const std::uint8_t* row = frame.data() + static_cast<std::ptrdiff_t>(y) * frame.stride();
    for (int x = 0; x < picture->width; ++x, row += 2) {
      const int value = big ? row[0] << 8 | row[1] : row[1] << 8 | row[0];
      *to++ = each * static_cast<float>(value);
    }
  }
  return picture;
}

}  // namespace

DepthInput::DepthInput(GstElement* element, Statistics& statistics,
                       std::function<SceneInputSettings()> settings)
    : element_(element), statistics_(statistics), settings_(std::move(settings)) {
  statistics.declare({"depth-frames", "depth-frames-unmatchable", "depth-frames-unusable",
                      "frames-without-depth", "depth-losses"});
  gst_video_info_init(&info_);
}

// ---- the element's thread

/// Whether the frame at \p time, or none any more, can come: one is there for then or soon after, or
/// the last two are later.
bool DepthInput::reaches(std::int64_t time) const {
  const auto later = [&](const Arrived& frame) { return difference(frame.time, time) >= 0; };
  const auto next = [&](const Arrived& frame) {
    return later(frame) && difference(frame.time, time) <= soon;
  };
  return std::any_of(arrived_.begin(), arrived_.end(), next) ||
         (arrived_.size() >= 2 && later(arrived_.back()) && later(*std::next(arrived_.rbegin())));
}

/// Lets go what is of no use for \p time or later: of files what is older, and what came first from
/// far later, where time has \p jumped back or is behind it in what has come.
void DepthInput::clear_before(std::int64_t time, bool jumped) {
  const auto far_later = [&](const Arrived& frame) { return difference(frame.time, time) > soon; };
  const auto useless = [&] {
    if (!far_later(arrived_.front())) return !live_ && difference(arrived_.front().time, time) < 0;
    return jumped || !std::all_of(arrived_.begin(), arrived_.end(), far_later);
  };
  while (!arrived_.empty() && useless()) {
    arrived_.pop_front();
    changed_.notify_all();
  }
}

/// Whether nothing has come for the last second of live video's frames, nor is there for this one.
bool DepthInput::is_silent(std::int64_t time) {
  const bool waits = !arrived_.empty() && difference(arrived_.back().time, time) >= 0;
  if (std::exchange(has_come_, false) || waits || !heard_ || difference(time, *heard_) < 0)
    heard_ = time;
  return !ended_ && difference(time, *heard_) > GST_SECOND;
}

std::size_t DepthInput::waiting_bytes() const {
  std::size_t bytes = 0;
  for (const Arrived& frame : arrived_) bytes += frame.info.size;
  return bytes;
}

/// Half of how long the frame lasts, or the depth's if those are shorter, of which one that is nearer
/// may be yet to come.
std::int64_t DepthInput::tolerance_for(std::int64_t duration) const {
  const int numerator = GST_VIDEO_INFO_FPS_N(&info_), denominator = GST_VIDEO_INFO_FPS_D(&info_);
  if (numerator <= 0 || denominator <= 0) return duration / 2;  // of either may be 0: not known
  const auto own =
      static_cast<std::int64_t>(gst_util_uint64_scale_int(GST_SECOND, denominator, numerator));
  return duration > 0 ? std::min(duration, own) / 2 : own / 2;
}

/// Takes the nearest that is within half of \p duration of \p time; what is older than that goes.
Ref<GstBuffer> DepthInput::find(std::int64_t time, std::int64_t duration,
                                std::optional<std::int64_t> longest, GstVideoInfo& info,
                                bool& newly_lost) {
  Lock lock(mutex_);
  const std::int64_t tolerance = tolerance_for(duration);
  const std::int64_t step = asked_ ? difference(time, *asked_) : 0;
  if (longest) {
    if (!lost_ && step > longest_step) heard_ = time;
    const bool was_lost = std::exchange(lost_, is_silent(time));
    if (lost_) longest = 0;
    newly_lost = lost_ && !was_lost;
  }
  const bool jumped = step < -soon;
  asked_ = time;
  clear_before(time - tolerance, jumped);
  wait(lock, longest, [&] {
    clear_before(time - tolerance, false);
    return reaches(time - tolerance);
  });
  const auto apart = [&](const Arrived& frame) { return std::abs(difference(frame.time, time)); };
  const auto nearest =
      std::min_element(arrived_.begin(), arrived_.end(),
                       [&](const Arrived& a, const Arrived& b) { return apart(a) < apart(b); });
  if (nearest == arrived_.end() || apart(*nearest) > tolerance) return nullptr;
  info = nearest->info;
  Ref<GstBuffer> found(gst_buffer_ref(nearest->buffer.get()));
  // It stays: the frame after may be shown again.
  arrived_.erase(arrived_.begin(), nearest);
  changed_.notify_all();
  return found;
}

std::shared_ptr<const DepthPicture> DepthInput::at(GstBuffer* frame, const GstSegment& segment,
                                                   std::int64_t duration,
                                                   std::optional<std::int64_t> longest,
                                                   double near) {
  if (!linked()) return nullptr;
  const SceneMatch match = settings_().match;
  const auto time = time_of_frame(frame, segment, match);
  GstVideoInfo info;
  bool newly_lost = false;
  {
    const std::scoped_lock lock(mutex_);
    period_ = period_of_frame(frame, match);
  }
  const Ref<GstBuffer> found = time ? find(*time, duration, longest, info, newly_lost) : nullptr;
  if (newly_lost)
    statistics_.warn(element_, "depth-losses",
                     "At the pad depth nothing has come for a second: frames go on without, and "
                     "wait for it no longer. See whether its sender is there.");
  if (!found) {
    statistics_.count("frames-without-depth");
    return nullptr;
  }
  if (!(near > 0.0)) {
    statistics_.warn(element_, "frames-without-depth",
                     "There is a depth video, but the messages at the pad scene have no "
                     "'depth_near', which tells its measure: it is not used.");
    return nullptr;
  }
  try {
    return picture_of(info, found.get(), near);
  } catch (const std::exception& error) {
    statistics_.warn(element_, "depth-frames-unusable",
                     fmt::format("A frame at the pad depth is not used: {}", error.what()));
    return nullptr;
  }
}

void DepthInput::video_flushed() {
  const std::scoped_lock lock(mutex_);
  asked_.reset();
  heard_.reset();
}

// ---- the pad's thread

GstFlowReturn DepthInput::take(Ref<GstBuffer> buffer) {
  const SceneInputSettings settings = settings_();
  Lock lock(mutex_);
  if (flushing_) return GST_FLOW_FLUSHING;
  if (GST_VIDEO_INFO_FORMAT(&info_) == GST_VIDEO_FORMAT_UNKNOWN) return GST_FLOW_NOT_NEGOTIATED;
  const auto time = time_of_frame(buffer.get(), segment_, settings.match);
  if (!time) {
    lock.unlock();
    statistics_.warn(element_, "depth-frames-unmatchable",
                     fmt::format("A frame at the pad depth {}; it is not used.",
                                 missing_in_frames(settings.match)));
    return GST_FLOW_OK;
  }
  statistics_.count("depth-frames");
  const GstFlowReturn held = hold(lock, [&] { return arrived_.size() >= most_of_files; });
  if (held != GST_FLOW_OK) return held;
  has_come_ = true;
  arrived_.push_back({*time, std::move(buffer), info_});
  while (arrived_.size() > most_live || (arrived_.size() > 1 && waiting_bytes() > most_bytes))
    arrived_.pop_front();
  changed_.notify_all();
  return GST_FLOW_OK;
}

bool DepthInput::hear_caps(GstCaps* caps) {
  const std::scoped_lock lock(mutex_);
  return gst_video_info_from_caps(&info_, caps);
}

void DepthInput::forget() {
  arrived_.clear();
  asked_.reset();
  heard_.reset();
  has_come_ = lost_ = false;
}

}  // namespace polyhull::element
