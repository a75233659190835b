// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The sink pads of hullbuild: one camera each.
#pragma once

#include <gst/base/gstaggregator.h>

#include <atomic>
#include <memory>
#include <optional>
#include <string>

#include "common/payload_buffer.h"
#include "wire/view_sets.h"

namespace polyhull::element {

/// What a pad knows; belongs to the element's streaming thread except where said.
struct HullPadState {
  std::string camera;  ///< property, under the pad's object lock; empty: the view's own name

  std::unique_ptr<ViewBuffer> view;  ///< the parsed front of the queue
  GstBuffer* parsed = nullptr;       ///< whose front it is (a reference)
  ViewHead head;

  std::unique_ptr<ViewBuffer> held;  ///< the last view used, for missing-camera=hold
  std::int64_t held_time = no_time;
  std::atomic<bool> flushed{false};  ///< set by the flushing thread: forget everything
  std::uint64_t last_trigger = no_trigger;
  std::int64_t last_time = no_time;

  void forget_front();
  void reset();
};

struct PolyhullHullPad {
  GstAggregatorPad parent;
  HullPadState* state;
};

struct PolyhullHullPadClass {
  GstAggregatorPadClass parent_class;
};

GType hull_pad_type();

inline HullPadState& state_of(gpointer pad) {
  return *static_cast<PolyhullHullPad*>(pad)->state;
}

/// The pad's property `camera`.
std::string camera_property(GstAggregatorPad* pad);

/// Running time of \p time in the pad's segment, no_time where it has none.
std::int64_t running_time(GstAggregatorPad* pad, GstClockTime time);

}  // namespace polyhull::element
