// SPDX-License-Identifier: LGPL-2.1-or-later
// Which cameras a set lacks, whether it may be built without them, and what is shown if not.
#include <algorithm>
#include <memory>
#include <utility>

#include "plugins/hullbuild/private.h"

namespace polyhull::element {
namespace {

/// How many cameras have to be left, where so many are connected, and how many times as large they may
/// make the hull: what is worse is no person's shape any more (docs/missing-camera.md).
constexpr std::size_t automatic_fewest = 3;
constexpr double most_growth = 2.5;

/// The last set that was shown, with \p opacity.
GstBuffer* build_again(HullBuild& self, const HullSettings& settings, float opacity) {
  std::vector<std::unique_ptr<ViewBuffer>> last;
  std::vector<SetView> views;
  for (const ShownView& view : self.shown_views) {
    last.push_back(std::make_unique<ViewBuffer>(view.buffer.get()));
    views.push_back({view.camera, last.back().get()});
  }
  self.statistics.count("sets-fading");
  GST_DEBUG_OBJECT(self.element, "the last set is shown again, with an opacity of %.0f %%",
                   100.0 * static_cast<double>(opacity));
  return build_views(self, std::move(views), settings, no_trigger, opacity);
}

}  // namespace

std::int64_t length_of(const Pads& pads, const ViewDecision& set) {
  if (set.time == no_time) return 0;
  return state_of<HullPadState>(pads[set.heads.front()]).parsed.end() - set.time;
}

std::int64_t hold_time_of(const HullSettings& settings, std::int64_t length) {
  const auto hold = static_cast<std::int64_t>(settings.hold_time);
  return hold > 0 ? std::max(hold, length) : 0;
}

std::vector<AbsentCamera> absent_cameras(HullBuild& self, const Pads& pads,
                                         const ViewDecision& set) {
  const std::int64_t now = self.timing.live() ? self.timing.now() : no_time;
  const std::int64_t interval = length_of(pads, set);
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

bool must_be_whole(const std::vector<AbsentCamera>& absent, const HullSettings& settings,
                   std::int64_t length) {
  if (settings.missing_camera == MissingCamera::drop_set) return true;
  if (settings.missing_camera != MissingCamera::freeze) return false;
  const std::int64_t hold = hold_time_of(settings, length);
  return std::any_of(absent.begin(), absent.end(), [&](const AbsentCamera& camera) {
    if (camera.ended || !camera.known) return false;
    return camera.missed <= hold || (camera.silent <= hold && camera.missed <= 10 * hold);
  });
}

std::string find_lack(HullBuild& self, std::size_t pads, const std::vector<SetView>& views,
                      bool whole, const HullSettings& settings) {
  self.growth.reset();
  const std::size_t fewest =
      settings.min_cameras > 0 ? settings.min_cameras : std::min(automatic_fewest, pads);
  if (views.size() < fewest) return fmt::format("{} views, {} are asked for", views.size(), fewest);
  // What all cameras make is what the growth is beyond; and what a camera that the last set lacked would
  // have cut away is not known.
  const auto was_shown = [&](const SetView& view) {
    return std::any_of(self.shown_views.begin(), self.shown_views.end(),
                       [&](const ShownView& shown) { return shown.camera == view.camera; });
  };
  if (settings.min_cameras > 0 || whole || !std::all_of(views.begin(), views.end(), was_shown))
    return {};
  std::vector<std::string> cameras;
  for (const SetView& view : views) cameras.push_back(view.camera);
  // Once for all sets that lack the same.
  if (std::exchange(self.judged_cameras, cameras) != cameras)
    self.judged_growth = self.stage.growth(cameras);
  if (!self.judged_growth) return {};  // nobody was there to be seen
  self.growth = self.shown_growth * *self.judged_growth;
  if (*self.growth <= most_growth) return {};
  return fmt::format("the hull would be {:.1f} times as large", *self.growth);
}

void note_shown(HullBuild& self, const std::vector<SetView>& views) {
  self.fade.shown();
  self.shown_views.clear();
  for (const SetView& view : views)
    self.shown_views.push_back({view.camera, Ref<GstBuffer>(gst_buffer_ref(view.view->buffer()))});
  self.shown_growth = self.growth.value_or(1.0);
  self.judged_cameras.clear();
}

void forget_shown(HullBuild& self) {
  self.fade.lose_picture();
  self.shown_views.clear();
  self.shown_growth = 1.0;
  self.judged_cameras.clear();
}

GstBuffer* fading_set(HullBuild& self, const std::vector<SetView>& views,
                      const HullSettings& settings) {
  const auto opacity = self.fade.hide(static_cast<std::int64_t>(settings.hold_time));
  if (!opacity) return nullptr;
  if (!self.shown_views.empty()) return build_again(self, settings, *opacity);
  return build_views(self, views, settings, no_trigger, *opacity);
}

GstBuffer* settled_set(HullBuild& self, const HullSettings& settings) {
  const auto opacity = self.fade.settle();
  if (!opacity || self.shown_views.empty()) return nullptr;
  return build_again(self, settings, *opacity);
}

}  // namespace polyhull::element
