// SPDX-License-Identifier: LGPL-2.1-or-later
// What a set's silhouettes say of each other, counted and told.
#include <algorithm>

#include "plugins/common/object_lock.h"
#include "plugins/hullbuild/private.h"

namespace polyhull::element {
void note_repairs(HullBuild& self, const Pads& pads, std::int64_t now) {
  const std::vector<CameraRepair>& repairs = self.stage.repairs();
  for (GstAggregatorPad* pad : pads) {
    HullPadState& state = state_of<HullPadState>(pad);
    for (const CameraRepair& repair : repairs) {
      if (repair.camera != state.name) continue;
      state.holes_filled += repair.holes;
      state.pieces_dropped += repair.pieces;
    }
  }
  self.words.repaired(GST_ELEMENT_CAST(self.element), now, repairs);
}

namespace {

/// The tangency errors into the statistics.
void tell_tangencies(HullBuild& self) {
  const std::vector<std::string>& cameras = self.tangencies.cameras();
  std::vector<std::pair<std::string, double>> pixels;
  double largest = 0.0;
  for (const PairTangency& pair : self.tangencies.pairs()) {
    pixels.emplace_back(cameras[pair.first] + "-" + cameras[pair.second], pair.error);
    largest = std::max(largest, pair.error);
  }
  self.statistics.set("tangency-px", largest);
  const ObjectLock lock(self.element);
  self.tangency_pixels = std::move(pixels);
}

}  // namespace

void note_doubts(HullBuild& self, std::int64_t now) {
  const std::optional<CameraDoubts>& doubts = self.stage.doubts();
  if (!doubts || now == no_time) return;
  if (doubts->asked.empty()) {
    self.doubts.reset();
    self.tangencies.reset();
    tell_tangencies(self);
  } else {
    self.doubts.add(now, self.stage.cameras(), *doubts);
    if (self.tangencies.add(now, self.stage.cameras(), self.stage.tangencies()))
      tell_tangencies(self);
  }
  Contradiction& contradiction = self.contradiction = self.doubts.contradiction();
  add_tangency(contradiction, self.doubts, self.tangencies);
  self.statistics.set("contradiction-percent", 100.0 * contradiction.share);
  self.statistics.count("sets-contradicted", contradiction.rig);
  self.words.contradicted(GST_ELEMENT_CAST(self.element), now, contradiction);
}

void note_hull(HullBuild& self, std::int64_t now, std::size_t used) {
  GstElement* element = GST_ELEMENT_CAST(self.element);
  if (self.stage.all_see_foreground())
    self.words.hull(element, now, used, self.stage.is_empty(), self.contradiction,
                    [&] { return self.stage.elsewhere(); });
  if (self.stage.is_empty()) return;
  const Rig& rig = self.stage.rig();
  self.statistics.count("sets-implausible", self.words.size(element, self.stage.size(), rig));
  if (!rig.bounds) self.words.unbounded(element, rig);
}

void forget_contradictions(HullBuild& self) {
  self.doubts.reset();
  self.tangencies.reset();
  self.contradiction = {};
  self.words.new_rig();
}

}  // namespace polyhull::element
