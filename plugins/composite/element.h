// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the parts of the element composite share: its instance, its pads at one moment, and the
/// work of its streaming thread.
#pragma once

#include <gst/base/gstaggregator.h>

#include <atomic>
#include <optional>
#include <string_view>
#include <vector>

#include "plugins/common/live/live_aggregator.h"
#include "plugins/composite/background_picture.h"
#include "plugins/composite/frame.h"

namespace polyhull::element {

/// A frame that OpenGL still draws: the background in its place.
struct HeldFrame {
  GstBuffer* buffer = nullptr;  ///< null: none is held
  GstVideoInfo info;
  unsigned place = 0;                     ///< for FrameComposer::take()
  std::int64_t due = no_time;             ///< running time when it goes out if no other frame comes
  std::optional<std::uint64_t> newcomer;  ///< as Composite::newcomer, of this frame
};

struct Composite : LiveAggregator {
  static constexpr char type_name[] = "PolyhullComposite";
  static void class_init(gpointer klass);

  explicit Composite(gpointer object);
  void property_set(gpointer object, std::string_view name);
  bool hear(GstAggregatorPad* pad, GstEvent* event);
  gboolean navigate(GstEvent* event);
  bool answer(GstQuery* query);
  GstStructure* statistics_of(gpointer object);
  /// Emits `composited` if a frame that was handed on is the first to show the set \p shown.
  void tell_composited(std::optional<std::uint64_t> shown);

  /// Both formats unknown; a GstVideoInfo of zeros may not be asked for its format.
  void forget_formats() {
    gst_video_info_init(&background_info);
    gst_video_info_init(&output_info);
  }
  CompositeSettings settings;  // under the object lock
  ViewportControl control;     // under the object lock

  std::atomic<bool> announced{false};
  std::atomic<int> height{0};  // of the background, for mouse and keys

  CompositeGl gl;  // this and the rest belong to the source pad's thread; it guards context queries
  FrameComposer composer{gl, statistics};
  BackgroundPicture picture{statistics};
  GstVideoInfo background_info;  // as the picture's: RGBA
  bool background_on_gpu = false;
  GstVideoInfo output_info;
  bool output_on_gpu = false;
  std::uint64_t next_content = 1;
  /// Trigger number (no_trigger: none) of the latest set that no frame sent shows yet.
  std::optional<std::uint64_t> newcomer;
  HeldFrame held;
  bool send_held_first = false;  // before the output's format changes
};

/// References on the sink pads as they are now.
struct CompositePads {
  explicit CompositePads(gpointer element);
  Pads all;
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
