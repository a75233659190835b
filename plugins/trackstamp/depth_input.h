// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The sink pad `depth` of trackstamp: a second video that tells how far away is what the first shows.
#pragma once

#include <gst/gst.h>
#include <gst/video/video.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>

#include "plugins/common/live/side_pad.h"
#include "plugins/common/memory/mapped_memory.h"
#include "plugins/common/statistics.h"
#include "plugins/trackstamp/scene_match.h"
#include "render/depth_picture.h"

namespace polyhull::element {

inline constexpr char depth_caps[] = "video/x-raw, format=(string){ GRAY16_LE, GRAY16_BE }";

/// Takes frames at the pad on its streaming thread, and is asked on the element's. Frames that do not
/// come live wait there when they are ahead. Counts depth-frames, depth-frames-unmatchable,
/// depth-frames-unusable, frames-without-depth and depth-losses.
class DepthInput final : public SidePad {
 public:
  /// \p settings gives those of now, from any thread.
  DepthInput(GstElement* element, Statistics& statistics,
             std::function<SceneInputSettings()> settings);

  /// The depth of \p frame, of \p segment, \p duration ns long (0: not known): the nearest frame that
  /// is no more than half of that away, or half of its own, whose largest value stands for \p near metres; null where there is
  /// none. Waits for it, but at most \p longest ns (none: as long as it takes).
  std::shared_ptr<const DepthPicture> at(GstBuffer* frame, const GstSegment& segment,
                                         std::int64_t duration, std::optional<std::int64_t> longest,
                                         double near);
  /// The frame to come does not follow the one before.
  void video_flushed();

 private:
  struct Arrived {
    std::int64_t time;
    Ref<GstBuffer> buffer;
    GstVideoInfo info;
  };
  GstFlowReturn take(Ref<GstBuffer> buffer) override;
  bool hear_caps(GstCaps* caps) override;
  void forget() override;
  Ref<GstBuffer> find(std::int64_t time, std::int64_t duration, std::optional<std::int64_t> longest,
                      GstVideoInfo& info, bool& newly_lost);
  bool reaches(std::int64_t time) const;
  std::size_t waiting_bytes() const;
  std::int64_t tolerance_for(std::int64_t duration) const;
  void clear_before(std::int64_t time, bool jumped);
  bool is_silent(std::int64_t time);
  std::int64_t difference(std::int64_t a, std::int64_t b) const {
    return time_difference(a, b, period_);
  }

  GstElement* element_;
  Statistics& statistics_;
  std::function<SceneInputSettings()> settings_;
  // Under the lock:
  GstVideoInfo info_;
  std::deque<Arrived> arrived_;        // as they came
  std::int64_t period_ = 0;            // of the latest frame's clock
  std::optional<std::int64_t> asked_;  // its time
  std::optional<std::int64_t> heard_;  // the one's that something had come for
  bool has_come_ = false;              // something, since
  bool lost_ = false;                  // it has been said
};

}  // namespace polyhull::element
