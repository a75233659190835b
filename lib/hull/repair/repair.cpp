// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/repair/repair.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/thread_pool.h"
#include "hull/repair/agreement.h"
#include "hull/repair/ring_regions.h"

namespace polyhull {
namespace {

using hull::Agreement;
using hull::points_inside;
using hull::RingRegion;

/// Rays through a ring's region, about.
constexpr int rays = 64;
/// So many pixels across it is more than the contours' tolerance.
constexpr double thin = 1.0;
/// The share of a hole's rays that must meet the body.
constexpr double whole = 0.98;
/// The share of a hole's rays that must be proven wrong.
constexpr double proof_enough = 0.05;
/// Pixels from a witness's outline on: nearer to it outlines and calibrations err.
constexpr double well_inside = 4.0;
/// The share of a piece's rays that must meet something.
constexpr double piece_seen = 0.5;

/// Of each kind in a silhouette. Hundreds of holes are noise, for which min-hole-area is there.
constexpr std::size_t most_rings = 32;
/// In how many other silhouettes proof is looked for. In all seven of eight cameras it cost twice as
/// much and found no more.
constexpr std::size_t most_witnesses = 4;
/// Two that agree, against one.
constexpr std::size_t least_others = 2;

struct Candidate {
  std::uint32_t view, ring;
  double area;
  std::vector<Vec2> points;
  bool seen = false;
  double proof = 0.0;  // share of rays
};

class Search {
 public:
  Search(std::span<const Silhouette> silhouettes, const RepairOptions& options)
      : silhouettes_(silhouettes),
        options_(options),
        agreement_(silhouettes, options.unseen),
        repairs_(silhouettes.size()) {
    for (const Silhouette& view : silhouettes) {
      regions_.push_back(hull::regions_of(*view.rings));
      witnesses_.push_back(witnesses_of(*view.camera));
    }
  }

  std::vector<ViewRepair> run() {
    if (options_.repair == Repair::both) drop_pieces();
    fill_holes();
    return std::move(repairs_);
  }

 private:
  void drop_pieces();
  void fill_holes();
  std::vector<std::size_t> witnesses_of(const Camera& camera) const;
  std::vector<Candidate> candidates(bool holes) const;
  bool is_seen(const Candidate& candidate, double share, Agreement::Scratch& scratch) const;
  double share_proven(const Candidate& hole, Agreement::Scratch& scratch) const;
  bool proven(std::size_t view, const Vec2& pixel, Agreement::Scratch& scratch) const;
  void leave_out(const Candidate& candidate);

  /// Calls work(candidate, scratch) for all of them.
  template <class Work>
  void for_each(std::vector<Candidate>& candidates, Work work) const {
    parallel_for(candidates.size(), 1, options_.threads, [&](std::size_t begin, std::size_t end) {
      Agreement::Scratch scratch;
      for (std::size_t i = begin; i < end; ++i) work(candidates[i], scratch);
    });
  }

  std::span<const Silhouette> silhouettes_;
  const RepairOptions& options_;
  Agreement agreement_;
  std::vector<std::vector<RingRegion>> regions_;
  std::vector<std::vector<std::size_t>> witnesses_;  // for each view
  std::vector<ViewRepair> repairs_;
};

/// The views that best see what a hole of \p camera cuts out of the hull: those that look along it.
std::vector<std::size_t> Search::witnesses_of(const Camera& camera) const {
  const auto axis = [](const Camera& c) { return Vec3(c.R[0][2], c.R[1][2], c.R[2][2]); };
  std::vector<std::pair<double, std::size_t>> others;
  for (std::size_t j = 0; j < silhouettes_.size(); ++j)
    if (silhouettes_[j].camera != &camera)
      others.emplace_back(-std::abs(glm::dot(axis(camera), axis(*silhouettes_[j].camera))), j);
  std::sort(others.begin(), others.end());
  std::vector<std::size_t> witnesses;
  for (std::size_t i = 0; i < std::min(others.size(), most_witnesses); ++i)
    witnesses.push_back(others[i].second);
  return witnesses;
}

/// The largest holes, or pieces of silhouettes that have several, without those left out.
std::vector<Candidate> Search::candidates(bool holes) const {
  std::vector<Candidate> found;
  for (std::uint32_t v = 0; v < regions_.size(); ++v) {
    const auto wanted = [&](const RingRegion& region) {
      return holes ? region.area < 0.0 : region.area > 0.0;
    };
    if (!holes && std::count_if(regions_[v].begin(), regions_[v].end(), wanted) < 2) continue;
    const std::size_t begin = found.size();
    for (std::uint32_t r = 0; r < regions_[v].size(); ++r)
      if (wanted(regions_[v][r]) &&
          !std::binary_search(repairs_[v].leave_out.begin(), repairs_[v].leave_out.end(), r))
        found.push_back({v, r, regions_[v][r].area, {}});
    std::stable_sort(
        found.begin() + static_cast<std::ptrdiff_t>(begin), found.end(),
        [](const Candidate& a, const Candidate& b) { return std::abs(a.area) > std::abs(b.area); });
    if (found.size() > begin + most_rings) found.resize(begin + most_rings);
  }
  return found;
}

/// Whether \p share of the rays have something behind them which none of the others rejects.
bool Search::is_seen(const Candidate& candidate, double share, Agreement::Scratch& scratch) const {
  const auto count = static_cast<double>(candidate.points.size());
  double misses_left = std::floor((1.0 - share) * count);
  for (const Vec2& p : candidate.points)
    if (agreement_.longest(candidate.view, p, least_others, scratch).across < thin &&
        --misses_left < 0.0)
      return false;
  return true;
}

/// Leaves out the ring and those directly in it, which are of its other side.
void Search::leave_out(const Candidate& candidate) {
  ViewRepair& repair = repairs_[candidate.view];
  ++(candidate.area < 0.0 ? repair.holes : repair.pieces);
  const std::vector<RingRegion>& regions = regions_[candidate.view];
  for (std::uint32_t r = 0; r < regions.size(); ++r)
    if (r == candidate.ring || regions[r].parent == static_cast<std::int32_t>(candidate.ring))
      repair.leave_out.push_back(r);
  std::sort(repair.leave_out.begin(), repair.leave_out.end());
  repair.leave_out.erase(std::unique(repair.leave_out.begin(), repair.leave_out.end()),
                         repair.leave_out.end());
  agreement_.replace(candidate.view,
                     without_rings(*silhouettes_[candidate.view].rings, repair.leave_out));
}

void Search::drop_pieces() {
  std::vector<Candidate> pieces = candidates(false);
  for_each(pieces, [&](Candidate& piece, Agreement::Scratch& scratch) {
    piece.points = points_inside(*silhouettes_[piece.view].rings, piece.ring, piece.area, rays);
    piece.seen = is_seen(piece, piece_seen, scratch);
  });
  for (const Candidate& piece : pieces) {
    const bool another = std::any_of(pieces.begin(), pieces.end(), [&](const Candidate& other) {
      return other.view == piece.view && other.seen;
    });
    if (another && !piece.seen && !piece.points.empty()) leave_out(piece);
  }
}

void Search::fill_holes() {
  std::vector<Candidate> holes = candidates(true);
  for_each(holes, [&](Candidate& hole, Agreement::Scratch& scratch) {
    hole.points = points_inside(*silhouettes_[hole.view].rings, hole.ring, hole.area, rays);
    hole.seen = is_seen(hole, whole, scratch);
  });
  std::erase_if(holes, [](const Candidate& hole) { return !hole.seen || hole.points.empty(); });
  while (!holes.empty()) {
    for_each(holes, [&](Candidate& hole, Agreement::Scratch& scratch) {
      hole.proof = share_proven(hole, scratch);
    });
    const auto most =
        std::max_element(holes.begin(), holes.end(),
                         [](const Candidate& a, const Candidate& b) { return a.proof < b.proof; });
    if (most->proof < proof_enough) break;
    leave_out(*most);
    most->proof = 0.0;
    // What the hull covers as it is, it also covers when there is more of it.
    std::erase_if(holes, [](const Candidate& hole) { return hole.proof == 0.0; });
  }
}

bool is_in_frame(const Camera& camera, const Vec2& pixel) {
  return pixel.x > -0.5 && pixel.y > -0.5 && pixel.x < camera.width - 0.5 &&
         pixel.y < camera.height - 0.5;
}

/// Whether the ray shows that the hole at \p pixel is none of the subject's: a witness sees what the
/// others see behind it, which the hole alone takes away from all that the witness's ray could meet.
bool Search::proven(std::size_t view, const Vec2& pixel, Agreement::Scratch& scratch) const {
  const Agreement::Stretch stretch = agreement_.longest(view, pixel, least_others, scratch);
  if (stretch.across < thin || !std::isfinite(stretch.depth)) return false;
  const Camera& camera = agreement_.camera(view);
  const Vec3 X = camera.centre() + stretch.depth * camera.ray(pixel);
  for (const std::size_t j : witnesses_[view]) {
    // No witness rejects X, which so lies inside the silhouette or, under Unseen::keep, out of the frame,
    // where the witness sees nothing.
    const auto at = agreement_.camera(j).project_ideal(X);
    if (at && is_in_frame(agreement_.camera(j), *at) &&
        !agreement_.near_outline(j, *at, well_inside) &&
        agreement_.is_only_objector(j, *at, view, scratch))
      return true;
  }
  return false;
}

/// The share of the hole's rays that show that; 0 where every other one is looked at in vain, as of
/// a gap.
double Search::share_proven(const Candidate& hole, Agreement::Scratch& scratch) const {
  std::size_t count = 0;
  for (const std::size_t first : {0, 1}) {
    for (std::size_t i = first; i < hole.points.size(); i += 2)
      count += proven(hole.view, hole.points[i], scratch);
    if (count == 0) return 0.0;
  }
  return static_cast<double>(count) / static_cast<double>(hole.points.size());
}

bool are_finite(const Rings& rings) {
  return std::all_of(rings.points.begin(), rings.points.end(),
                     [](const Vec2f& p) { return std::isfinite(p.x) && std::isfinite(p.y); });
}

}  // namespace

std::vector<ViewRepair> find_repairs(std::span<const Silhouette> silhouettes,
                                     const RepairOptions& options) {
  if (options.repair == Repair::off || silhouettes.size() <= least_others)
    return std::vector<ViewRepair>(silhouettes.size());
  for (const Silhouette& view : silhouettes)
    if (!are_finite(*view.rings)) return std::vector<ViewRepair>(silhouettes.size());
  return Search(silhouettes, options).run();
}

Rings without_rings(const Rings& rings, std::span<const std::uint32_t> leave_out) {
  Rings kept;
  for (std::uint32_t r = 0; r < rings.size(); ++r) {
    if (std::binary_search(leave_out.begin(), leave_out.end(), r)) continue;
    const std::span<const Vec2f> ring = rings.ring(r);
    kept.points.insert(kept.points.end(), ring.begin(), ring.end());
    kept.ends.push_back(static_cast<std::uint32_t>(kept.points.size()));
  }
  return kept;
}

}  // namespace polyhull
