// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the parts of hullbuild share: its state, the fronts of its pads' queues, its sets.
#pragma once

#include <gst/base/gstaggregator.h>

#include <atomic>
#include <vector>

#include "plugins/common/live/input_watch.h"
#include "plugins/common/live/live_pace.h"
#include "plugins/common/live/live_timing.h"
#include "plugins/hullbuild/set_builder.h"
#include "plugins/hullbuild/pad.h"
#include "plugins/hullbuild/properties.h"
#include "plugins/hullbuild/words.h"

namespace polyhull::element {

/// The element's state.
struct HullBuildState {
  explicit HullBuildState(GstAggregator* element)
      : timing(element),
        pace(GST_ELEMENT_CAST(element), statistics),
        watch(GST_ELEMENT_CAST(element), InputWatch::In::files) {}

  HullSettings settings;  // under the object lock

  std::atomic<bool> rig_changed{false};
  std::atomic<bool> new_segment{true};
  std::atomic<std::int64_t> start_wait{0};  // for cameras that have not sent anything yet

  Statistics statistics{"hullbuild-stats"};
  LiveTiming timing;
  LivePace pace;
  InputWatch watch;
  SetBuilder stage{statistics};  // this and the rest belong to the source pad's thread
  ViewSets sets;
  std::int64_t first_time = no_time;  // of the stream's first view
  std::int64_t last_time = no_time;   // of the last instant, and
  std::int64_t interval = 0;          // the least time between two, where views have no length
  std::vector<std::int64_t> unexplained;  // dropped instants whose camera may only be silent
  HullWords words;
};

struct PolyhullHullBuild {
  GstAggregator parent;
  HullBuildState* priv;
};

inline PolyhullHullBuild* self_of(gpointer object) {
  return static_cast<PolyhullHullBuild*>(object);
}
inline HullBuildState& private_of(gpointer object) {
  return *self_of(object)->priv;
}

/// References on the sink pads as they are now.
class Pads {
 public:
  explicit Pads(gpointer element) {
    GST_OBJECT_LOCK(element);
    for (GList* l = GST_ELEMENT_CAST(element)->sinkpads; l != nullptr; l = l->next)
      pads_.push_back(GST_AGGREGATOR_PAD(gst_object_ref(l->data)));
    GST_OBJECT_UNLOCK(element);
  }
  ~Pads() {
    for (GstAggregatorPad* pad : pads_) gst_object_unref(pad);
  }
  Pads(const Pads&) = delete;
  Pads& operator=(const Pads&) = delete;
  std::size_t size() const { return pads_.size(); }
  GstAggregatorPad* operator[](std::size_t i) const { return pads_[i]; }
  auto begin() const { return pads_.begin(); }
  auto end() const { return pads_.end(); }

 private:
  std::vector<GstAggregatorPad*> pads_;
};

// ---- hullbuild_fronts.cpp

/// The camera that the pad's views count as: the pad's property, else the view's own name.
std::string name_of(GstAggregatorPad* pad, const View& view);

/// Parses the front of the pad's queue unless that has been done; drops what is no view.
ViewHead look_at(PolyhullHullBuild* self, GstAggregatorPad* pad);

/// Removes the fronts of the pads \p which.
void drop_fronts(const Pads& pads, const std::vector<std::size_t>& which);

/// Throws Error unless each pad with a view has a camera of the rig, of the right size, and no two
/// have the same.
void check_cameras(PolyhullHullBuild* self, const Pads& pads);

/// Running time until which what waits is waited for in a live stream: no_time where nothing waits
/// that has a time, 0 where all cameras have something there.
std::int64_t next_deadline(PolyhullHullBuild* self, const Pads& pads);

// ---- hullbuild_sets.cpp

/// Forgets all pads' views and the last set.
void forget_streams(PolyhullHullBuild* self);

/// Makes and sends the next mesh, if there is a set. Throws Error.
GstFlowReturn send_next_set(PolyhullHullBuild* self, bool deadline_passed);

}  // namespace polyhull::element
