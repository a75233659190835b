// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The sink pads of hullbuild: one camera each.
#pragma once

#include <gst/base/gstaggregator.h>

#include <atomic>
#include <memory>
#include <optional>
#include <string>

#include "mesh/view_sets.h"
#include "plugins/common/live/live_pad.h"
#include "plugins/common/memory/payload_buffer.h"

namespace polyhull::element {

struct HullPadSettings {
  std::string camera;  ///< empty: the view's own name
};

/// What a pad knows; belongs to the element's streaming thread except where said.
struct HullPadState {
  static constexpr char type_name[] = "PolyhullHullPad";
  static GType base_type() { return type_of<LivePadState>(); }
  static void class_init(gpointer klass);
  explicit HullPadState(gpointer pad);
  ~HullPadState() { forget_front(); }

  HullPadSettings settings;  ///< under the pad's object lock

  Arrival parsed;                    ///< what came first, once it has been looked at
  std::unique_ptr<ViewBuffer> view;  ///< ... parsed; null for a gap
  ViewHead head;
  bool ended = false;  ///< nothing will come

  std::string told_rig;          ///< the rig file's text that its stream brings; empty: none
  bool kept_no_rig = false;      ///< it was recorded without one
  std::uint64_t told_after = 0;  ///< so many were told to the element before it

  std::unique_ptr<ViewBuffer> held;  ///< the last view used, for missing-camera=hold
  std::int64_t held_time = no_time;
  std::uint64_t last_trigger = no_trigger;  ///< of the last view that was in time
  std::int64_t last_time = no_time;
  bool delivered = false;               ///< a view of it has been in a set
  std::int64_t missed_since = no_time;  ///< sets have lacked it from this running time on

  std::string name;                   ///< of its camera, under the pad's object lock
  std::string brought;                ///< the camera of its last view, which may not be one
  std::int64_t brought_at = no_time;  ///< running time of that view

  /// Views that were of no use: that came after their set had gone, twice, before the first set's
  /// time, as no view; whose set was dropped.
  std::atomic<std::uint64_t> late{0}, duplicate{0}, early{0}, unusable{0}, given_up{0};
  std::atomic<std::uint64_t> jumps{0};  ///< of its clock

  /// What was mended of its silhouettes.
  std::atomic<std::uint64_t> holes_filled{0}, pieces_dropped{0};

  void forget_front();
  void reset();
};

/// The pad's property `camera`.
std::string camera_property(GstAggregatorPad* pad);

}  // namespace polyhull::element
