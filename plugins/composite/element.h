// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the parts of the element composite share: its instance, its pads at one moment, and the
/// work of its streaming thread.
#pragma once

#include <gst/base/gstaggregator.h>

#include <atomic>
#include <vector>

#include "plugins/common/live/input_watch.h"
#include "plugins/common/live/live_pace.h"
#include "plugins/common/live/live_timing.h"
#include "plugins/common/statistics.h"
#include "plugins/composite/frame.h"
#include "plugins/composite/navigation.h"

namespace polyhull::element {

struct CompositePrivate {
  explicit CompositePrivate(GstElement* element)
      : timing(GST_AGGREGATOR(element)), pace(element, statistics), watch(element), gl(element) {
    forget_formats();
  }
  /// Both formats unknown; a GstVideoInfo of zeros may not be asked for its format.
  void forget_formats() {
    gst_video_info_init(&background_info);
    gst_video_info_init(&output_info);
  }
  CompositeSettings settings;  // under the object lock
  ViewportControl control;     // under the object lock

  std::atomic<bool> announced{false};
  std::atomic<bool> new_segment{true};

  Statistics statistics{"composite-stats"};
  LiveTiming timing;
  LivePace pace;
  InputWatch watch;
  CompositeGl gl;  // this and the rest belong to the source pad's thread; it guards context queries
  FrameComposer composer{gl, statistics};
  GstVideoInfo background_info;
  bool background_on_gpu = false;
  GstVideoInfo output_info;
  bool output_on_gpu = false;
  std::uint64_t next_content = 1;
};

struct PolyhullComposite {
  GstAggregator parent;
  CompositePrivate* priv;
};

struct PolyhullCompositeClass {
  GstAggregatorClass parent_class;
};

inline PolyhullComposite* self_of(gpointer object) {
  return static_cast<PolyhullComposite*>(object);
}
inline CompositePrivate& private_of(gpointer object) {
  return *self_of(object)->priv;
}

/// References on the sink pads as they are now.
struct CompositePads {
  explicit CompositePads(gpointer element);
  ~CompositePads();
  CompositePads(const CompositePads&) = delete;
  std::vector<GstAggregatorPad*> meshes;
  GstAggregatorPad* background = nullptr;  ///< null: not requested
};

/// Throws Error where there is no pad for the background.
void check_background(const CompositePads& pads);

// Virtual functions of GstAggregator.
GstFlowReturn composite_aggregate(GstAggregator* aggregator, gboolean timeout);
GstClockTime composite_next_time(GstAggregator* aggregator);
GstFlowReturn composite_flush(GstAggregator* aggregator);
gboolean composite_start(GstAggregator* aggregator);
gboolean composite_stop(GstAggregator* aggregator);

}  // namespace polyhull::element
