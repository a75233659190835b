// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The sink pad `depth` of trackstamp: a second video that tells how far away is what the first shows.
#pragma once

#include <gst/gst.h>
#include <gst/video/video.h>

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "plugins/common/memory/mapped_memory.h"
#include "plugins/common/statistics.h"
#include "plugins/trackstamp/scene_match.h"
#include "render/depth_picture.h"

namespace polyhull::element {

inline constexpr char depth_caps[] = "video/x-raw, format=(string){ GRAY16_LE, GRAY16_BE }";

/// Takes frames at the pad on its streaming thread, and is asked on the element's. Frames that do not
/// come live wait there when they are ahead. Counts depth-frames, depth-frames-unmatchable,
/// depth-frames-unusable and frames-without-depth.
class DepthInput {
 public:
  /// \p settings gives those of now, from any thread.
  DepthInput(GstElement* element, Statistics& statistics,
             std::function<SceneInputSettings()> settings);
  DepthInput(const DepthInput&) = delete;

  /// A new pad called `depth`, which the caller adds to the element; called once.
  GstPad* make_pad(GstPadTemplate* pad_template);
  bool linked() const { return pad_ != nullptr && gst_pad_is_linked(pad_); }

  /// The depth of \p frame, of \p segment, \p duration ns long (0: not known): the frame that is no
  /// more than half of that away, whose largest value stands for \p near metres; null where there is
  /// none. Waits for it, but at most \p longest ns (none: as long as it takes).
  std::shared_ptr<const DepthPicture> at(GstBuffer* frame, const GstSegment& segment,
                                         std::int64_t duration, std::optional<std::int64_t> longest,
                                         double near);

  /// Ends waiting, now and from now on, until it is allowed again.
  void unlock(bool unlocked);
  /// Passes an event that goes upstream on to where the depth comes from; takes the reference.
  void push_upstream(GstEvent* event);

 private:
  struct Arrived {
    std::int64_t time;
    BufferRef buffer;
    GstVideoInfo info;
  };
  static DepthInput& of(GstPad* pad);
  static GstFlowReturn chain(GstPad* pad, GstObject*, GstBuffer* buffer);
  static gboolean event(GstPad* pad, GstObject*, GstEvent* event);
  static gboolean query(GstPad* pad, GstObject* parent, GstQuery* query);
  static gboolean activate(GstPad* pad, GstObject*, GstPadMode mode, gboolean active);

  GstFlowReturn take(BufferRef buffer);
  bool hear(GstPad* pad, GstEvent* event);
  void forget(bool flushing);
  BufferRef find(std::int64_t time, std::int64_t tolerance, std::optional<std::int64_t> longest,
                 GstVideoInfo& info);

  GstElement* element_;
  Statistics& statistics_;
  std::function<SceneInputSettings()> settings_;
  GstPad* pad_ = nullptr;  // the element's
  std::mutex mutex_;       // protects all below; no pad is called with it
  std::condition_variable changed_;
  GstSegment segment_;
  GstVideoInfo info_;
  std::deque<Arrived> arrived_;  // as they came
  bool live_ = false, ended_ = false, flushing_ = true, unlocked_ = false;
};

}  // namespace polyhull::element
