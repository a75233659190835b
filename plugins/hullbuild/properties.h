// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What users can set on hullbuild.
#pragma once

#include <algorithm>
#include <span>
#include <string>

#include "hull/hull.h"
#include "hull/repair/repair.h"
#include "plugins/common/live/live_timing.h"
#include "plugins/common/property_table.h"

namespace polyhull::element {

/// What becomes of a set besides its views.
enum class HullSurface {
  polyhedral,  ///< the visual hull
  none,        ///< nothing, for who draws the silhouettes' intersection without a mesh
};

/// What to do with a set that lacks the view of a camera.
enum class MissingCamera { drop_set, drop_camera, hold, freeze };

/// Times in ns, lengths in world units.
struct HullSettings {
  std::string rig;
  std::uint64_t sync_tolerance = 8 * GST_MSECOND;
  std::uint64_t max_wait = LiveSettings{}.max_wait;
  std::uint64_t max_latency = LiveSettings{}.max_latency;
  MissingCamera missing_camera = MissingCamera::freeze;
  std::uint64_t hold_time = 40 * GST_MSECOND;
  std::uint32_t min_cameras = 0;
  double weld_distance = 0.0;
  Unseen unseen = Unseen::carve;
  bool use_bounds = true;
  double max_deviation = 0.0;
  Repair repair = Repair::off;
  HullSurface surface = HullSurface::polyhedral;
  bool check_cameras = true;
  bool adaptive = false;
  std::uint32_t threads = 0;
  std::uint32_t pool_threads = 0;

  /// What of them says how long to wait; a max_wait above 60 s counts as 60 s.
  LiveSettings live() const {
    const bool by_hand = GST_CLOCK_TIME_IS_VALID(max_wait);
    return {by_hand ? std::min<std::uint64_t>(max_wait, 60 * GST_SECOND) : max_wait, max_latency};
  }
};

/// One row per property of HullSettings.
std::span<const Property<HullSettings>> hull_properties();

}  // namespace polyhull::element
