// SPDX-License-Identifier: LGPL-2.1-or-later
#include "mesh/set_spread.h"

#include <algorithm>

#include "base/median.h"

namespace polyhull {
namespace {

constexpr std::size_t most_sets = 100;

}  // namespace

void SetSpread::add(const std::vector<CameraTime>& set) {
  if (set.size() < 2) return;
  std::vector<std::int64_t> times;
  for (const CameraTime& view : set) times.push_back(view.time);
  const auto [first, last] = std::minmax_element(times.begin(), times.end());
  spreads_.push_back(*last - *first);
  const std::int64_t centre = median(times);
  offsets_.push_back(set);
  for (CameraTime& view : offsets_.back()) view.time -= centre;
  if (spreads_.size() <= most_sets) return;
  spreads_.pop_front();
  offsets_.pop_front();
}

std::optional<SetSpread::Spread> SetSpread::spread() const {
  if (spreads_.empty()) return std::nullopt;
  const auto [first, last] = std::minmax_element(spreads_.begin(), spreads_.end());
  return Spread{*first, median(std::vector<std::int64_t>(spreads_.begin(), spreads_.end())), *last};
}

std::map<std::string, std::int64_t> SetSpread::offsets() const {
  std::map<std::string, std::vector<std::int64_t>> all;
  for (const auto& set : offsets_)
    for (const CameraTime& view : set) all[view.camera].push_back(view.time);
  std::map<std::string, std::int64_t> result;
  for (auto& [camera, values] : all) result[camera] = median(std::move(values));
  return result;
}

}  // namespace polyhull
