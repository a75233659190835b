// SPDX-License-Identifier: LGPL-2.1-or-later
#include "run/latency.h"

#include <algorithm>
#include <numeric>

namespace polyhull {
namespace {

constexpr int deepest = 200;  // elements one after another; more is a loop
}  // namespace

void LatencyTrace::handed_over(double time, std::int64_t instant, const std::string& from,
                               const std::string& to, bool aside) {
  Instant& handed = instants_[instant];
  const auto same = std::find_if(handed.begin(), handed.end(), [&](const Handed& other) {
    return other.from == from && other.to == to && other.aside == aside;
  });
  if (same != handed.end()) {
    same->time = time;
  } else {
    handed.push_back({from, to, aside, time});
  }
  if (instants_.size() > most_instants) instants_.erase(instants_.begin());
}

/// When the first of the pictures that \p element's output was made of left its camera; none where
/// no camera's picture of this instant is in it. Adds the cameras to \p cameras.
std::optional<double> LatencyTrace::first_picture(const Instant& instant,
                                                  const std::string& element,
                                                  std::set<std::string>& cameras) {
  std::optional<double> first;
  std::vector<std::string> ahead{element};
  for (std::size_t i = 0; i < ahead.size(); ++i) {
    bool has_input = false;
    for (const Handed& handed : instant) {
      if (handed.to != ahead[i]) continue;
      has_input = true;
      if (handed.aside) continue;
      first = std::min(first.value_or(handed.time), handed.time);
      if (std::find(ahead.begin(), ahead.end(), handed.from) == ahead.end())
        ahead.push_back(handed.from);
    }
    if (!has_input) cameras.insert(ahead[i]);
  }
  if (cameras.empty()) return std::nullopt;  // a background alone
  return first;
}

void LatencyTrace::reached(double time, std::int64_t instant, const std::string& output,
                           const std::string& last) {
  const auto found = instants_.find(instant);
  if (found == instants_.end()) return;
  std::set<std::string> cameras;
  const std::optional<double> first = first_picture(found->second, last, cameras);
  if (!first) return;
  Output& out = outputs_[output];
  out.latencies.push_back(time - *first);
  out.cameras.merge(cameras);
  std::string element = last;
  double left = time;
  for (int step = 0; step < deepest; ++step) {
    const Handed* latest = nullptr;
    for (const Handed& handed : found->second)
      if (handed.to == element && !handed.aside && (!latest || handed.time > latest->time))
        latest = &handed;
    if (!latest) break;
    out.shares[element] += left - latest->time;
    left = latest->time;
    element = latest->from;
  }
  out.other_cameras += left - *first;
}

LatencyReport LatencyTrace::report(const std::string& output) const {
  LatencyReport report;
  const auto found = outputs_.find(output);
  if (found == outputs_.end()) return report;
  std::vector<double> sorted = found->second.latencies;
  std::sort(sorted.begin(), sorted.end());
  const auto count = static_cast<double>(sorted.size());
  report.frames = sorted.size();
  report.minimum = 1e3 * sorted.front();
  report.maximum = 1e3 * sorted.back();
  report.median = 1e3 * (sorted[(sorted.size() - 1) / 2] + sorted[sorted.size() / 2]) / 2.0;
  report.mean = 1e3 * std::accumulate(sorted.begin(), sorted.end(), 0.0) / count;
  for (const auto& [element, seconds] : found->second.shares)
    report.shares[element] = 1e3 * seconds / count;
  report.other_cameras = 1e3 * found->second.other_cameras / count;
  report.cameras = found->second.cameras;
  return report;
}

}  // namespace polyhull
