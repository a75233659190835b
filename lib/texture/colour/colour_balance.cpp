// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/colour/colour_balance.h"

#include <algorithm>
#include <cmath>

#include "texture/colour/positive_system.h"

namespace polyhull {
void ColourBalance::reset() {
  names_.clear();
  pairs_.clear();
  last_.reset();
  known_ = 0.0;
}

/// How much an instant counts beside all before it: a mean over the time since the first one, and
/// from the time constant on over about that.
double ColourBalance::share_of_news(std::optional<double> time, double time_constant) {
  if (time && last_ && *time < *last_) reset();
  const bool first = names_.empty();
  const double step = first ? 0.0 : time && last_ ? *time - *last_ : 1.0 / 25.0;
  if (time || last_) last_ = time ? *time : *last_ + step;
  if (first) return 1.0;
  known_ += step;
  if (!(time_constant > 0.0)) return 1.0;
  return step > 0.0 ? step / (step + std::min(known_, time_constant)) : 0.0;
}

std::size_t ColourBalance::number_of(std::string_view name) {
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found != names_.end()) return static_cast<std::size_t>(found - names_.begin());
  const std::size_t before = names_.size();
  std::vector<Pair> larger((before + 1) * (before + 1));
  for (std::size_t a = 0; a < before; ++a)
    std::copy_n(&pairs_[a * before], before, &larger[a * (before + 1)]);
  pairs_.swap(larger);
  names_.emplace_back(name);
  return before;
}

std::vector<double> ColourBalance::solve(int channel) const {
  // One place in a thousand that agrees as well as pictures can.
  constexpr double tie = 4.0 / (0.1 * 0.1);
  const std::size_t n = names_.size();
  std::vector<double> matrix(n * n), right(n);
  for (std::size_t a = 0; a < n; ++a) {
    matrix[a * n + a] += tie;
    for (std::size_t b = a + 1; b < n; ++b) {
      const double weight = pairs_[a * n + b].weight[channel];
      const double weighted = pairs_[a * n + b].weighted[channel];
      matrix[a * n + a] += weight;
      matrix[b * n + b] += weight;
      matrix[a * n + b] -= weight;
      matrix[b * n + a] -= weight;
      right[a] -= weighted;
      right[b] += weighted;
    }
  }
  solve_positive(matrix, right);
  const double limit = std::log(most);
  for (double& value : right) value = std::clamp(value, -limit, limit);
  return right;
}

std::vector<Vec3f> ColourBalance::update(const Hull& hull, const ColourViews& views,
                                         std::span<const std::string_view> names,
                                         std::optional<double> time, double time_constant) {
  constexpr std::size_t most_cameras = 64;
  const double share = share_of_news(time, time_constant);
  std::vector<std::size_t> numbers;
  for (const std::string_view name : names) numbers.push_back(number_of(name));
  if (names_.size() > most_cameras) {  // those of a rig that is gone
    reset();
    last_ = time;
    numbers.clear();
    for (const std::string_view name : names) numbers.push_back(number_of(name));
  }
  if (!hull.empty()) {
    for (const ColourPair& seen : colour_pairs(hull, views)) {
      const std::size_t a = numbers[seen.a], b = numbers[seen.b];
      Pair& kept = pair(std::min(a, b), std::max(a, b));
      const Vec3 ratio = a < b ? seen.ratio : -seen.ratio;
      kept.weighted += share * (seen.weight * ratio - kept.weighted);
      kept.weight += share * (seen.weight - kept.weight);
    }
  }
  std::vector<Vec3f> gains(names.size(), Vec3f(1.0f));
  for (int c = 0; c < 3; ++c) {
    const std::vector<double> logs = solve(c);
    for (std::size_t k = 0; k < gains.size(); ++k)
      gains[k][c] = static_cast<float>(std::exp(logs[numbers[k]]));
  }
  return gains;
}

}  // namespace polyhull
