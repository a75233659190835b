// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the parts of hullbuild share: its state, the fronts of its pads' queues, its sets.
#pragma once

#include <gst/base/gstaggregator.h>

#include <atomic>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "live/fade.h"
#include "mesh/instants.h"
#include "plugins/common/live/live_aggregator.h"
#include "plugins/common/log.h"
#include "plugins/hullbuild/coarsening.h"
#include "plugins/hullbuild/doubt_watch.h"
#include "plugins/hullbuild/pad.h"
#include "plugins/hullbuild/properties.h"
#include "plugins/hullbuild/set_builder.h"
#include "plugins/hullbuild/set_times.h"
#include "plugins/hullbuild/tangency_watch.h"
#include "plugins/hullbuild/words.h"

GST_DEBUG_CATEGORY_EXTERN(hullbuild_debug);
#define GST_CAT_DEFAULT hullbuild_debug

namespace polyhull::element {

/// A view that was shown.
struct ShownView {
  std::string camera;
  Ref<GstBuffer> buffer;
};

/// The element's state.
struct HullBuild : LiveAggregator {
  static constexpr char type_name[] = "PolyhullHullBuild";
  static void class_init(gpointer klass);

  explicit HullBuild(gpointer object);
  void property_set(gpointer object, std::string_view name);
  GstStructure* statistics_of(gpointer object);
  bool hear(GstAggregatorPad* pad, GstEvent* event);
  void hear_load(GstEvent* event) { load.hear(event); }

  HullSettings settings;  // under the object lock
  /// Of each pair of cameras, by name: its tangency error. Under the object lock.
  std::vector<std::pair<std::string, double>> tangency_pixels;

  std::atomic<bool> rig_changed{false};
  std::atomic<bool> live{false};            // as of the last look at the inputs
  std::atomic<std::int64_t> start_wait{0};  // for cameras that have not sent anything yet

  std::mutex instants_mutex;  // protects the next
  Instants instants;

  LoadWatch load;  // this and the next have locks of their own
  SetTimes times;
  SetBuilder stage{statistics};  // this and the rest belong to the source pad's thread
  std::string told_rig;          // the rig file's text that the views bring; empty: none
  std::uint64_t rigs_told = 0;   // by all pads
  bool rigs_differ = false;      // two pads bring different ones
  bool rig_assumed = false;      // none is set, nor kept with recorded views
  ViewSets sets;
  Fade fade;
  std::vector<ShownView> shown_views;  // of the last set
  /// How many times as large as with all cameras the hull is: of the set that is looked at (none: not
  /// known, or not asked for), and of the last one that was shown. Where one has a camera that the one
  /// before lacked, its cameras count as all.
  std::optional<double> growth;
  double shown_growth = 1.0;
  /// As SetBuilder::growth() has it for these cameras since the last set that was shown.
  std::vector<std::string> judged_cameras;
  std::optional<double> judged_growth;
  std::int64_t first_time = no_time;      // of the stream's first view
  std::int64_t last_time = no_time;       // of the last instant, and
  std::int64_t interval = 0;              // the least time between two, where views have no length
  std::vector<std::int64_t> unexplained;  // dropped instants whose camera may only be silent
  DoubtWatch doubts;
  TangencyWatch tangencies;
  Contradiction contradiction;  // of both
  HullWords words;
};

// ---- absent.cpp

/// How long the views of \p set last, ns; 0 where they do not say.
std::int64_t length_of(const Pads& pads, const ViewDecision& set);

/// For how long what was there is held where a set whose views last \p length lacks a camera, ns: one
/// frame at least, unless nothing is to be held.
std::int64_t hold_time_of(const HullSettings& settings, std::int64_t length);

/// Notes which cameras the set has and lacks; returns those that it lacks.
std::vector<AbsentCamera> absent_cameras(HullBuild& self, const Pads& pads,
                                         const ViewDecision& set);

/// Whether an incomplete set, whose views last \p length, must not be built, by missing-camera. A camera that sends, but too
/// late or not everything, is waited for ten times as long as one that is silent.
bool must_be_whole(const std::vector<AbsentCamera>& absent, const HullSettings& settings,
                   std::int64_t length);

/// Why \p views, of the cameras of \p pads, \p whole if of all, do not bound the subject well enough to be
/// shown; empty: they do. Sets HullBuild::growth.
std::string find_lack(HullBuild& self, std::size_t pads, const std::vector<SetView>& views,
                      bool whole, const HullSettings& settings);

/// The last set that was shown, to be shown once more in the place of that of \p views, which cannot be,
/// as it fades out; where it is forgotten those themselves, with an opacity of 0. Null: nothing is to be
/// sent.
GstBuffer* fading_set(HullBuild& self, const std::vector<SetView>& views,
                      const HullSettings& settings);

/// The last set that was shown, to be shown once more as the end of a fade that no set goes on with; null:
/// nothing is to be sent.
GstBuffer* settled_set(HullBuild& self, const HullSettings& settings);

/// Notes that the set of \p views has been built and is shown.
void note_shown(HullBuild& self, const std::vector<SetView>& views);
/// Another rig's sets follow: the last set cannot be shown again, though downstream still has it.
void forget_shown(HullBuild& self);

// ---- contradictions.cpp

/// Counts what was mended for each camera, and says so where it lasts.
void note_repairs(HullBuild& self, const Pads& pads, std::int64_t now);

/// Says so where silhouettes have contradicted each other for a while.
void note_doubts(HullBuild& self, std::int64_t now);

/// Says so where the hull of a set at running time \p now (ns) of \p used cameras cannot be right:
/// none although all see a foreground, of a size that no subject has, open below.
void note_hull(HullBuild& self, std::int64_t now, std::size_t used);

/// Sets by another rig follow.
void forget_contradictions(HullBuild& self);

// ---- fronts.cpp

/// The camera that the pad's views count as: the pad's property, else the view's own name.
std::string name_of(GstAggregatorPad* pad, const View& view);

/// Parses the front of the pad's queue unless that has been done; drops what is no view.
ViewHead look_at(HullBuild& self, GstAggregatorPad* pad);

/// Removes the fronts of the pads \p which.
void drop_fronts(const Pads& pads, const std::vector<std::size_t>& which);

/// Throws Error unless each pad with a view has a camera of the rig, of the right size, and no two
/// have the same. In a live stream such a view is dropped, with a warning, and false is returned.
bool check_cameras(HullBuild& self, const Pads& pads);

/// Running time until which what waits is waited for in a live stream: no_time where nothing waits
/// that has a time, 0 where all cameras have something there.
std::int64_t next_deadline(HullBuild& self, const Pads& pads);

// ---- hullbuild.cpp

/// Finds the rig that the views bring: of the pads' rigs the one that was told last, as the others'
/// streams may not have come to it yet. Says so where views that wait bring different ones.
void note_told_rigs(HullBuild& self, const Pads& pads, const HullSettings& settings);

/// Notes the times of the views of \p set for `stats` and the message `polyhull-sets`, which has the
/// same fields.
void note_times(HullBuild& self, const Pads& pads, const ViewDecision& set,
                const HullSettings& settings);

// ---- instant_text.cpp: for the log

/// The instant of \p set, and which camera took its view when:
/// "instant 0:00:00.040000000 (cam0 +0 us, cam1 +12 us), trigger 3".
std::string instant_text(const Pads& pads, const ViewDecision& set);

/// The views at the fronts \p which, with their times.
std::string views_text(const Pads& pads, const std::vector<std::size_t>& which);

/// The cameras for which \p heads wait, with the pads of those that have sent nothing.
std::string waiting_text(const Pads& pads, const std::vector<ViewHead>& heads);

// ---- sets.cpp

/// Forgets all pads' views and the last set.
void forget_streams(HullBuild& self);

/// Takes up the rig that is to be used from now on: that of the property, else the one that came with
/// the views, else the built-in one. Throws Error.
void use_rig(HullBuild& self, const HullSettings& settings);

/// The mesh of \p views, as SetBuilder::build() has it; null, with a warning, where they cannot be built.
GstBuffer* build_views(HullBuild& self, std::vector<SetView> views, const HullSettings& settings,
                       std::uint64_t trigger, float opacity);

/// Makes and sends the next mesh, if there is a set; \p deadline_passed, where the stream is not
/// live: missing views are no longer waited for. Throws Error.
GstFlowReturn send_next_set(HullBuild& self, bool deadline_passed);

}  // namespace polyhull::element
