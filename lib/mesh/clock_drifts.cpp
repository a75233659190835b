// SPDX-License-Identifier: LGPL-2.1-or-later
#include "mesh/clock_drifts.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "base/median.h"
#include "base/nanoseconds.h"

namespace polyhull {
namespace {

constexpr std::int64_t block_length = 2 * second;
constexpr std::int64_t window = 300 * second;  // blocks a line is laid through
constexpr std::size_t fewest_points = 15;      // that are a line
constexpr std::size_t recent_points = 5;       // that tell the gain where there is no line
constexpr double least_rise = 3e6;             // ns; less is anybody's jitter
constexpr double straight = 0.1;               // of the rise, the points' distance from the line
constexpr double largest_rate = 1e-2;          // faster is no clock

}  // namespace

double ClockDrifts::note(Key key, std::int64_t time, std::int64_t arrival) {
  const std::int64_t block = arrival / block_length;
  if (block > block_) {  // threads may come in another order than their times
    close_block();
    block_ = block;
  }
  Camera& camera = cameras_[key];
  const bool known = camera.drifts;
  const std::int64_t lead = time - arrival;
  const bool opens = !camera.lead;
  if (opens || lead > *camera.lead) {
    camera.lead = lead;
    camera.time = arrival;
  }
  // The line is looked at once a block.
  if (opens && !known) judge(camera);
  return camera.drifts && !known ? 1e6 * camera.rate : 0;
}

void ClockDrifts::close_block() {
  std::vector<std::int64_t> gains;
  for (const auto& [key, camera] : cameras_)
    if (camera.lead && camera.first) gains.push_back(*camera.lead - *camera.first);
  if (!gains.empty() && gains.size() % 2 == 0) gains.push_back(0);
  const std::int64_t common = median(gains);
  for (auto& [key, camera] : cameras_) {
    if (!camera.lead) continue;
    // One that joins begins where the others are.
    if (!camera.first) camera.first = *camera.lead - common;
    camera.points.push_back(
        {camera.time, static_cast<double>(*camera.lead - *camera.first - common)});
    while (camera.points.front().time <= camera.time - window) camera.points.pop_front();
    if (camera.drifts) judge(camera);
    camera.lead.reset();
  }
}

void ClockDrifts::judge(Camera& camera) {
  const std::deque<Point>& points = camera.points;
  if (points.size() < fewest_points) return;
  const auto count = static_cast<double>(points.size());
  const std::int64_t since = points.back().time;
  double mean_time = 0, mean_gain = 0;  // times count from `since`
  for (const Point& point : points) {
    mean_time += static_cast<double>(point.time - since) / count;
    mean_gain += point.gain / count;
  }
  double over = 0, along = 0, squares = 0;
  for (const Point& point : points) {
    const double time = static_cast<double>(point.time - since) - mean_time;
    over += time * time;
    along += time * (point.gain - mean_gain);
    squares += (point.gain - mean_gain) * (point.gain - mean_gain);
  }
  const double rate = along / over;
  const double rise = std::abs(rate) * static_cast<double>(since - points.front().time);
  const double rms = std::sqrt(std::max(0.0, squares - rate * along) / count);
  const bool line = rms <= straight * rise && std::abs(rate) <= largest_rate;
  if (line && rise >= least_rise) camera.drifts = true;
  if (!camera.drifts) return;
  camera.since = since;
  if (line) {
    camera.rate = rate;
    camera.gained = mean_gain - rate * mean_time;
    return;
  }
  // It drifts no longer, or was taken for drifting: the last frames tell.
  std::vector<double> last;
  for (std::size_t i = points.size() - std::min(points.size(), recent_points); i < points.size();
       ++i)
    last.push_back(points[i].gain);
  camera.rate = 0;
  camera.gained = median(last);
}

std::int64_t ClockDrifts::gained(Key key, std::int64_t arrival) const {
  const auto found = cameras_.find(key);
  if (found == cameras_.end() || !found->second.drifts) return 0;
  const Camera& camera = found->second;
  return std::llround(camera.gained + camera.rate * static_cast<double>(arrival - camera.since));
}

}  // namespace polyhull
