// SPDX-License-Identifier: LGPL-2.1-or-later
// Which cameras a set lacks, and whether it may be built without them.
#include <algorithm>

#include "plugins/hullbuild/private.h"

namespace polyhull::element {

std::vector<AbsentCamera> absent_cameras(HullBuild& self, const Pads& pads,
                                         const ViewDecision& set) {
  const std::int64_t now = self.timing.live() ? self.timing.now() : no_time;
  const std::int64_t interval =
      set.time != no_time ? state_of<HullPadState>(pads[set.heads.front()]).parsed.end() - set.time
                          : 0;
  std::vector<AbsentCamera> absent;
  for (std::size_t i = 0; i < pads.size(); ++i) {
    HullPadState& state = state_of<HullPadState>(pads[i]);
    if (std::binary_search(set.heads.begin(), set.heads.end(), i)) {
      state.missed_since = no_time;
      continue;
    }
    if (state.missed_since == no_time && set.time != no_time)
      state.missed_since = set.time - interval;
    AbsentCamera camera{state.name.empty() ? GST_OBJECT_NAME(pads[i]) : state.name};
    camera.ended = state.ended;
    camera.known = state.delivered || state.view != nullptr;
    // Without times there is nothing to hold a picture by.
    camera.missed = set.time != no_time ? set.time - state.missed_since : INT64_MAX;
    const auto arrival = state_of<LivePadState>(pads[i]).punctuality.last_arrival();
    camera.silent = now != no_time && arrival ? now - *arrival : camera.missed;
    absent.push_back(std::move(camera));
  }
  return absent;
}

bool must_be_whole(const std::vector<AbsentCamera>& absent, const HullSettings& settings) {
  if (settings.missing_camera == MissingCamera::drop_set) return true;
  if (settings.missing_camera != MissingCamera::freeze) return false;
  const auto hold = static_cast<std::int64_t>(settings.hold_time);
  return std::any_of(absent.begin(), absent.end(), [&](const AbsentCamera& camera) {
    if (camera.ended || !camera.known) return false;
    return camera.missed <= hold || (camera.silent <= hold && camera.missed <= 10 * hold);
  });
}

}  // namespace polyhull::element
