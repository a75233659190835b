// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/hullbuild/set_times.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "plugins/hullbuild/words.h"

namespace polyhull::element {
namespace {

constexpr std::int64_t steadily = 3 * second;
constexpr int most_sets = 100;  // between two messages

double microseconds(std::int64_t time) {
  return 1e-3 * static_cast<double>(time);
}

}  // namespace

void SetTimes::note(GstElement* element, const std::vector<CameraTime>& set, By by,
                    std::int64_t tolerance) {
  ++sets_;
  if (set.size() < 2) return;
  {
    const std::scoped_lock lock(mutex_);
    spread_.add(set);
  }
  if (by == By::running_time && !std::exchange(said_running_, true))
    warn(element,
         "Views are matched by running time: not all cameras say when they took them, or not on "
         "one clock. That holds for branches of one pipeline that were started together, and no "
         "others. A trigger, timecodes or a shared clock (PTP, NTP) make it certain.");
  if (by != By::trigger) judge(element, set.front().time, tolerance);
}

void SetTimes::judge(GstElement* element, std::int64_t now, std::int64_t tolerance) {
  if (now >= judged_at_ && now - judged_at_ < second / 4) return;
  judged_at_ = now;
  for (const auto& [camera, offset] : spread_.offsets()) {
    Beside& known = beside_[camera];
    if (4 * std::abs(offset) <= tolerance) {
      known.since = -1;
      continue;
    }
    if (known.since < 0 || now < known.since) known.since = now;
    const bool said =
        known.said_at >= 0 && now >= known.said_at && now - known.said_at < again_after;
    if (now - known.since < steadily || said) continue;
    known.said_at = now;
    warn(element,
         fmt::format(
             "Camera {} has taken its pictures {:.2f} ms {} the others for {:.0f} s, where "
             "sync-tolerance is {:.2f} ms. Look at its trigger, its exposure time (times may "
             "be of its begin or end) and its clock.",
             camera, 1e-3 * microseconds(std::abs(offset)), offset > 0 ? "after" : "before",
             static_cast<double>(now - known.since) * 1e-9, 1e-3 * microseconds(tolerance)));
  }
}

void SetTimes::tell(GstStructure* stats) const {
  const std::scoped_lock lock(mutex_);
  const auto spread = spread_.spread();
  if (!spread) return;
  gst_structure_set(stats, "spread-minimum-us", G_TYPE_DOUBLE, microseconds(spread->smallest),
                    "spread-median-us", G_TYPE_DOUBLE, microseconds(spread->median),
                    "spread-maximum-us", G_TYPE_DOUBLE, microseconds(spread->largest), nullptr);
  for (const auto& [camera, offset] : spread_.offsets())
    gst_structure_set(stats, ("offset-us-" + camera).c_str(), G_TYPE_DOUBLE, microseconds(offset),
                      nullptr);
}

bool SetTimes::due() {
  const std::int64_t now = g_get_monotonic_time();
  if (sets_ == 0 || (sets_ < most_sets && now - told_at_ < G_USEC_PER_SEC)) return false;
  told_at_ = now;
  sets_ = 0;
  return true;
}

void SetTimes::reset() {
  const std::scoped_lock lock(mutex_);
  spread_.reset();
  beside_.clear();
  judged_at_ = -second;
  said_running_ = false;
  told_at_ = g_get_monotonic_time();
  sets_ = 0;
}

}  // namespace polyhull::element
