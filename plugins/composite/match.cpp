// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <optional>

#include "plugins/composite/frame.h"

namespace polyhull::element {

/// Where the pad asks for it, sets its exposure and slopes by the scene's light on its subject, for the
/// frames after this one.
void FrameComposer::match(GstAggregatorPad* pad) {
  MeshPadState& state = state_of<MeshPadState>(pad);
  if (!snapshot(pad, state.placement).match) return;
  const auto subject =
      std::find_if(plan_.subjects.begin(), plan_.subjects.end(),
                   [&](const PlacedSubject& placed) { return placed.content == state.content; });
  if (subject == plan_.subjects.end()) return;  // nothing to be seen yet
  std::optional<Vec3f> white;
  with_renderer([&](Renderer& renderer) { white = renderer.white(frame_, *subject); });
  if (!white)
    statistics_.warn(gl_.element(), "subjects-unmatched",
                     fmt::format("{} has nothing to be matched to: there is no scene, or no light "
                                 "in it. Set scene, or let the background announce one.",
                                 GST_OBJECT_NAME(pad)));
  GST_OBJECT_LOCK(pad);
  state.placement.match = false;
  if (white) set_white(state.placement, *white);
  GST_OBJECT_UNLOCK(pad);
  for (const char* name : {"match", "exposure", "slope-red", "slope-green", "slope-blue"})
    g_object_notify(G_OBJECT(pad), name);
}

}  // namespace polyhull::element
