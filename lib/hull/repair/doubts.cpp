// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/repair/doubts.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "hull/repair/agreement.h"

namespace polyhull {
namespace {

/// So many points say something.
constexpr std::uint32_t enough = 64;

/// The share of a view's points that are unexplained from which on it has background.
constexpr double background = 0.04;

/// Calls visit(p) for points evenly along the outlines of \p rings, \p step apart, the first at
/// \p at, each doubt_inset inside.
template <class Visit>
void along_outlines(const Rings& rings, double step, double at, Visit visit) {
  for (std::size_t r = 0; r < rings.size(); ++r) {
    const std::span<const Vec2f> ring = rings.ring(r);
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vec2 a(ring[i]), along = Vec2(ring[i + 1 == ring.size() ? 0 : i + 1]) - a;
      const double length = glm::length(along);
      for (; at < length; at += step)
        visit(a + at / length * along + doubt_inset / length * Vec2(along.y, -along.x));
      at -= length;
    }
  }
}

double outline_length(const Rings& rings) {
  double sum = 0.0;
  for (std::size_t r = 0; r < rings.size(); ++r) {
    const std::span<const Vec2f> ring = rings.ring(r);
    for (std::size_t i = 0; i < ring.size(); ++i)
      sum += glm::distance(Vec2(ring[i]), Vec2(ring[i + 1 == ring.size() ? 0 : i + 1]));
  }
  return sum;
}

}  // namespace

CameraDoubts& CameraDoubts::operator+=(const CameraDoubts& other) {
  for (std::size_t i = 0; i < asked.size(); ++i) {
    asked[i] += other.asked[i], unexplained[i] += other.unexplained[i];
    if (other.unexplained[i] > 0) where[i] = other.where[i];
  }
  for (std::size_t i = 0; i < against.size(); ++i) against[i] += other.against[i];
  return *this;
}

CameraDoubts& CameraDoubts::operator-=(const CameraDoubts& other) {
  for (std::size_t i = 0; i < asked.size(); ++i)
    asked[i] -= other.asked[i], unexplained[i] -= other.unexplained[i];
  for (std::size_t i = 0; i < against.size(); ++i) against[i] -= other.against[i];
  return *this;
}

double CameraDoubts::share_unexplained() const {
  const auto points = std::accumulate(asked.begin(), asked.end(), std::uint64_t{0});
  const auto of_them = std::accumulate(unexplained.begin(), unexplained.end(), std::uint64_t{0});
  return points >= enough ? static_cast<double>(of_them) / static_cast<double>(points) : 0.0;
}

double CameraDoubts::share_unexplained(std::span<const std::size_t> without) const {
  std::uint64_t points = 0, of_them = 0;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    if (std::find(without.begin(), without.end(), i) != without.end()) continue;
    points += asked[i], of_them += unexplained[i];
  }
  return points >= enough ? static_cast<double>(of_them) / static_cast<double>(points) : 1.0;
}

double CameraDoubts::share_against(std::size_t view) const {
  const std::size_t views = asked.size();
  std::size_t most = view;
  double most_share = -1.0;
  std::uint32_t points = 0, votes = 0;
  for (std::size_t i = 0; i < views; ++i) {
    if (i == view) continue;
    const std::uint32_t own = against[i * views + view];
    points += asked[i], votes += own;
    const double share = asked[i] > 0 ? static_cast<double>(own) / asked[i] : 0.0;
    if (share > most_share) most = i, most_share = share;
  }
  if (most == view) return 0.0;
  points -= asked[most], votes -= against[most * views + view];
  return points >= enough ? static_cast<double>(votes) / points : 0.0;
}

CameraDoubts find_doubts(std::span<const Silhouette> silhouettes, Unseen unseen, int points,
                         std::uint32_t round) {
  const std::size_t views = silhouettes.size();
  CameraDoubts doubts{std::vector<std::uint32_t>(views), std::vector<std::uint32_t>(views),
                      std::vector<std::uint32_t>(views * views), std::vector<Vec2>(views)};
  if (views < 4 || views > 64 || points < 1) return doubts;
  const hull::Agreement agreement(silhouettes, unseen);
  hull::Agreement::Scratch scratch;
  // Rounds begin anywhere in the first step: multiples of the golden section spread best.
  double whole;
  const double begin = std::modf(0.6180339887498949 * round, &whole);
  for (std::size_t k = 0; k < views; ++k) {
    const Rings& rings = *silhouettes[k].rings;
    const double step = outline_length(rings) / points;
    if (!(step > 0.0) || !std::isfinite(step)) continue;
    along_outlines(rings, step, begin * step, [&](const Vec2& pixel) {
      // Where the subject is thin the point lies beside it, or at its other outline.
      if (agreement.near_outline(k, pixel, doubt_inset - 0.5)) return;
      const int against = agreement.objector(k, pixel, scratch);
      ++doubts.asked[k];
      if (against != hull::Agreement::nobody) ++doubts.unexplained[k], doubts.where[k] = pixel;
      if (against >= 0) ++doubts.against[k * views + static_cast<std::size_t>(against)];
    });
  }
  return doubts;
}

int doubtful_camera(const CameraDoubts& doubts) {
  int worst = -1;
  double most = 0.0, next = 0.0;
  for (std::size_t k = 0; k < doubts.asked.size(); ++k) {
    const double share = doubts.share_against(k);
    next = std::max(next, std::min(share, most));
    if (share > most) worst = static_cast<int>(k), most = share;
  }
  return most >= 0.012 && most >= 2.0 * next ? worst : -1;
}

std::vector<std::size_t> views_with_background(const CameraDoubts& doubts) {
  std::vector<std::size_t> found;
  const std::size_t views = doubts.asked.size();
  for (std::size_t k = 0; k < views; ++k) {
    // Two views that contradict each other say nothing of who is wrong.
    const auto votes = doubts.against.begin() + static_cast<std::ptrdiff_t>(k * views);
    const std::uint32_t most = *std::max_element(votes, votes + static_cast<std::ptrdiff_t>(views));
    if (doubts.unexplained[k] - most > background * static_cast<double>(doubts.asked[k]))
      found.push_back(k);
  }
  if (2 * found.size() > views || doubtful_camera(doubts) >= 0 ||
      doubts.share_unexplained(found) > sound_share)
    found.clear();
  return found;
}

}  // namespace polyhull
