// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/hullbuild/tangency_watch.h"

#include <gst/gst.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace polyhull::element {
namespace {

// A median over the median_window changes after half of it.
constexpr std::int64_t median_window = 600 * GST_MSECOND, look_again = 200 * GST_MSECOND;

constexpr double gross = 10.0;  // px: a camera so far off cuts away what the others see
constexpr double agreed = 1.0;  // px by which outlines miss each other, about
constexpr double some = 0.33;   // of the planes

}  // namespace

bool TangencyWatch::add(std::int64_t now, const std::vector<std::string>& cameras,
                        std::vector<Tangency> tangencies) {
  if (cameras != cameras_ || (!entries_.empty() && entries_.back().time > now)) {
    reset();
    cameras_ = cameras;
  }
  entries_.push_back({now, std::move(tangencies)});
  while (entries_.front().time <= now - median_window) entries_.pop_front();
  if (!pairs_.empty() && now - looked_at_ < look_again) return false;
  looked_at_ = now;
  std::vector<Tangency> all;
  for (const Entry& entry : entries_)
    all.insert(all.end(), entry.tangencies.begin(), entry.tangencies.end());
  pairs_ = median_by_pair(all);
  return true;
}

TangencyWatch::Touches TangencyWatch::touches(std::size_t camera) const {
  Touches touches;
  if (entries_.empty()) return touches;
  int count = 0, sound = 0;
  double most = 0.0;
  for (const Tangency& tangency : entries_.back().tangencies) {
    if (tangency.first != camera && tangency.second != camera) continue;
    const double error = std::abs(tangency.error);
    ++count, sound += error < agreed;
    if (error <= most) continue;
    most = error;
    touches.farthest = tangency.first == camera ? tangency.at_first : tangency.at_second;
  }
  if (count > 0) touches.sound = static_cast<double>(sound) / count;
  return touches;
}

void add_tangency(Contradiction& contradiction, const DoubtWatch& doubts,
                  const TangencyWatch& tangencies) {
  const std::vector<std::string>& names = tangencies.cameras();
  const std::size_t cameras = names.size();
  std::erase_if(contradiction.background, [&](const Background& background) {
    const auto found = std::find(names.begin(), names.end(), background.camera);
    return tangencies.touches(static_cast<std::size_t>(found - names.begin())).sound < some;
  });
  // Planes touch the background, too.
  std::vector<PairTangency> pairs = tangencies.pairs();
  for (const Background& background : contradiction.background)
    std::erase_if(pairs, [&](const PairTangency& pair) {
      return names[pair.first] == background.camera || names[pair.second] == background.camera;
    });
  const std::size_t agreeing = agreeing_views(pairs, cameras);
  if (cameras >= 3 && 2 * agreeing <= cameras &&
      (cameras < 4 || contradiction.share >= contradictory)) {
    contradiction.camera.clear();
    contradiction.rig = true;
    contradiction.agreeing = agreeing;
    contradiction.cameras = cameras;
    return;
  }
  const int camera = camera_off(pairs, cameras);
  if (camera < 0) return;
  const auto number = static_cast<std::size_t>(camera);
  const double error = error_with(pairs, number);
  const TangencyWatch::Touches touches = tangencies.touches(number);
  if (error >= gross && touches.sound >= some && doubts.others_are_sound(names[number])) {
    contradiction.background.push_back({names[number], touches.farthest});
    return;
  }
  if (contradiction.camera.empty()) contradiction.camera = names[number];
  if (contradiction.camera != names[number]) return;
  contradiction.tangency = error;
  contradiction.others = error_without(pairs, number);
}

}  // namespace polyhull::element
