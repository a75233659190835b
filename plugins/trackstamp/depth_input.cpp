// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/trackstamp/depth_input.h"

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "plugins/common/memory/video_frame.h"

namespace polyhull::element {
namespace {

/// Frames that wait: of files until they are asked for, live ones until later ones have come.
constexpr std::size_t most_of_files = 4, most_live = 64;

std::chrono::steady_clock::time_point deadline_of(std::int64_t ns_from_now) {
  return std::chrono::steady_clock::now() + std::chrono::nanoseconds(ns_from_now);
}

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
                      "frames-without-depth"});
  gst_segment_init(&segment_, GST_FORMAT_UNDEFINED);
  gst_video_info_init(&info_);
}

GstPad* DepthInput::make_pad(GstPadTemplate* pad_template) {
  pad_ = gst_pad_new_from_template(pad_template, "depth");
  gst_pad_set_element_private(pad_, this);
  gst_pad_set_chain_function(pad_, chain);
  gst_pad_set_event_function(pad_, event);
  gst_pad_set_query_function(pad_, query);
  gst_pad_set_activatemode_function(pad_, activate);
  return pad_;
}

void DepthInput::unlock(bool unlocked) {
  const std::scoped_lock lock(mutex_);
  unlocked_ = unlocked;
  changed_.notify_all();
}

void DepthInput::push_upstream(GstEvent* event) {
  if (linked()) {
    gst_pad_push_event(pad_, event);
  } else {
    gst_event_unref(event);
  }
}

// ---- the element's thread

/// Takes what is within \p tolerance of \p time; what is older than that goes.
BufferRef DepthInput::find(std::int64_t time, std::int64_t tolerance,
                           std::optional<std::int64_t> longest, GstVideoInfo& info) {
  std::unique_lock lock(mutex_);
  const auto known = [&] {
    if (flushing_ || unlocked_ || ended_) return true;
    while (!live_ && !arrived_.empty() && arrived_.front().time < time - tolerance) {
      arrived_.pop_front();
      changed_.notify_all();
    }
    for (const Arrived& frame : arrived_)
      if (frame.time >= time - tolerance) return true;
    return false;
  };
  if (longest) {
    changed_.wait_until(lock, deadline_of(*longest), known);
  } else {
    // Who is unlinked meanwhile tells nobody.
    while (!known() && !live_ && linked()) changed_.wait_until(lock, deadline_of(GST_SECOND));
  }
  for (auto frame = arrived_.begin(); frame != arrived_.end(); ++frame) {
    if (std::abs(frame->time - time) > tolerance) continue;
    info = frame->info;
    BufferRef found(gst_buffer_ref(frame->buffer.get()));
    // It stays: the frame after may be shown again.
    arrived_.erase(arrived_.begin(), frame);
    changed_.notify_all();
    return found;
  }
  return nullptr;
}

std::shared_ptr<const DepthPicture> DepthInput::at(GstBuffer* frame, const GstSegment& segment,
                                                   std::int64_t duration,
                                                   std::optional<std::int64_t> longest,
                                                   double near) {
  if (!linked()) return nullptr;
  const auto time = time_of_frame(frame, segment, settings_().match);
  GstVideoInfo info;
  const BufferRef found = time ? find(*time, duration / 2, longest, info) : nullptr;
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

// ---- the pad's thread

DepthInput& DepthInput::of(GstPad* pad) {
  return *static_cast<DepthInput*>(gst_pad_get_element_private(pad));
}

GstFlowReturn DepthInput::take(BufferRef buffer) {
  const SceneInputSettings settings = settings_();
  std::unique_lock lock(mutex_);
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
  changed_.wait(lock, [&] { return flushing_ || live_ || arrived_.size() < most_of_files; });
  if (flushing_) return GST_FLOW_FLUSHING;
  arrived_.push_back({*time, std::move(buffer), info_});
  if (arrived_.size() > most_live) arrived_.pop_front();
  changed_.notify_all();
  return GST_FLOW_OK;
}

GstFlowReturn DepthInput::chain(GstPad* pad, GstObject*, GstBuffer* buffer) {
  return of(pad).take(BufferRef(buffer));
}

void DepthInput::forget(bool flushing) {
  const std::scoped_lock lock(mutex_);
  flushing_ = flushing;
  live_ = ended_ = false;
  arrived_.clear();
  gst_segment_init(&segment_, GST_FORMAT_UNDEFINED);
  changed_.notify_all();
}

/// Whether the event can be lived with.
bool DepthInput::hear(GstPad* pad, GstEvent* event) {
  switch (GST_EVENT_TYPE(event)) {
    case GST_EVENT_FLUSH_START:
      forget(true);
      break;
    case GST_EVENT_FLUSH_STOP:
      forget(false);
      break;
    case GST_EVENT_CAPS: {
      GstCaps* caps = nullptr;
      gst_event_parse_caps(event, &caps);
      const std::scoped_lock lock(mutex_);
      return gst_video_info_from_caps(&info_, caps);
    }
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
      break;
    }
    case GST_EVENT_EOS: {
      const std::scoped_lock lock(mutex_);
      ended_ = true;
      changed_.notify_all();
      break;
    }
    default:
      break;
  }
  return true;
}

gboolean DepthInput::event(GstPad* pad, GstObject*, GstEvent* event) {
  const bool good = of(pad).hear(pad, event);
  gst_event_unref(event);
  return good;
}

/// Nothing of the depth goes on into the stream of frames.
gboolean DepthInput::query(GstPad* pad, GstObject* parent, GstQuery* query) {
  const bool caps =
      GST_QUERY_TYPE(query) == GST_QUERY_CAPS || GST_QUERY_TYPE(query) == GST_QUERY_ACCEPT_CAPS;
  return caps ? gst_pad_query_default(pad, parent, query) : FALSE;
}

gboolean DepthInput::activate(GstPad* pad, GstObject*, GstPadMode mode, gboolean active) {
  if (mode != GST_PAD_MODE_PUSH) return FALSE;
  of(pad).forget(!active);
  return TRUE;
}

}  // namespace polyhull::element
