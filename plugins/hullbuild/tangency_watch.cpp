// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/hullbuild/tangency_watch.h"

#include <gst/gst.h>

#include <utility>

namespace polyhull::element {
namespace {

// A median over the median_window changes after half of it.
constexpr std::int64_t median_window = 600 * GST_MSECOND, look_again = 200 * GST_MSECOND;

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

void add_tangency(Contradiction& contradiction, const TangencyWatch& tangencies) {
  const std::size_t cameras = tangencies.cameras().size();
  const std::size_t agreeing = agreeing_views(tangencies.pairs(), cameras);
  if (cameras >= 3 && 2 * agreeing <= cameras &&
      (cameras < 4 || contradiction.share >= contradictory)) {
    contradiction.camera.clear();
    contradiction.rig = true;
    contradiction.agreeing = agreeing;
    contradiction.cameras = cameras;
    return;
  }
  const int camera = tangencies.camera();
  if (camera < 0) return;
  const auto number = static_cast<std::size_t>(camera);
  const std::string& name = tangencies.cameras()[number];
  if (contradiction.camera.empty()) contradiction.camera = name;
  if (contradiction.camera != name) return;
  contradiction.tangency = error_with(tangencies.pairs(), number);
  contradiction.others = error_without(tangencies.pairs(), number);
}

}  // namespace polyhull::element
