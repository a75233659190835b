// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/build/stage.h"
#include "hull/camera_contours.h"

#include <algorithm>

#include "base/stopwatch.h"
#include "hull/weld.h"

namespace polyhull {

HullStage::Contours& HullStage::undistorted(const CameraContours& view) {
  const auto [place, is_new] = contours_.try_emplace(view.camera->name);
  Contours& known = place->second;
  if (is_new || known.real != *view.rings || known.camera != *view.camera) {
    known.camera = *view.camera;
    known.real = *view.rings;
    known.ideal = undistort_rings(*view.camera, known.real);
    known.left_out.clear();
    known.is_new = true;
  }
  return known;
}

/// Sets repairs_, which are the last ones where nothing has changed.
void HullStage::find_repairs(std::span<const CameraContours> views, const RepairOptions& options) {
  const bool same = options == repair_options_ && views_ == repaired_ &&
                    std::none_of(views_.begin(), views_.end(),
                                 [](const Contours* contours) { return contours->is_new; });
  if (same) return;
  std::vector<Silhouette> silhouettes;
  for (std::size_t i = 0; i < views.size(); ++i)
    silhouettes.push_back({views[i].camera, &views_[i]->ideal.rings});
  repairs_ = polyhull::find_repairs(silhouettes, options);
  for (Contours* contours : views_) contours->is_new = false;
  repaired_ = views_;
  repair_options_ = options;
}

/// Makes the mended contours of \p contours.
void HullStage::mend(Contours& contours, const std::vector<std::uint32_t>& leave_out) {
  if (contours.left_out == leave_out) return;
  contours.left_out = leave_out;
  contours.mended_real = without_rings(contours.real, leave_out);
  contours.mended_ideal.rings = without_rings(contours.ideal.rings, leave_out);
  contours.mended_ideal.source.clear();
  std::uint32_t begin = 0, real_begin = 0, real_left_out = 0;
  for (std::uint32_t r = 0; r < contours.real.size(); ++r) {
    const std::uint32_t end = contours.ideal.rings.ends[r], real_end = contours.real.ends[r];
    if (std::binary_search(leave_out.begin(), leave_out.end(), r)) {
      real_left_out += real_end - real_begin;
    } else {
      for (std::uint32_t i = begin; i < end; ++i)
        contours.mended_ideal.source.push_back(contours.ideal.source[i] - real_left_out);
    }
    begin = end, real_begin = real_end;
  }
}

/// The real contour's edge that the pinhole contour's \p edge is a part of; those of the frame's
/// border follow the points in both.
std::uint32_t HullStage::real_edge(const Used& view, std::uint32_t edge) {
  const std::vector<std::uint32_t>& source = view.ideal->source;
  return edge < source.size()
             ? source[edge]
             : static_cast<std::uint32_t>(edge - source.size() + view.real->points.size());
}

const Hull& HullStage::build(std::span<const CameraContours> views, const HullOptions& options,
                             double weld_distance, Repair repair) {
  Stopwatch watch;
  views_.clear();
  for (const CameraContours& view : views) views_.push_back(&undistorted(view));
  seconds_undistort_ = watch.lap();
  find_repairs(views, {repair, options.unseen, options.threads});
  seconds_repair_ = watch.lap();
  used_.clear();
  std::vector<Silhouette> silhouettes;
  int with_foreground = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (repairs_[i].leave_out.empty()) {
      used_.push_back({views[i].rings, &views_[i]->ideal});
    } else {
      mend(*views_[i], repairs_[i].leave_out);
      used_.push_back({&views_[i]->mended_real, &views_[i]->mended_ideal});
    }
    silhouettes.push_back({views[i].camera, &used_.back().ideal->rings});
    with_foreground += !views[i].rings->empty();
  }
  if (with_foreground < 2) {
    is_builders_ = false;
    statistics_ = {};
    return hull_ = Hull();
  }
  const Hull& built = builder_.build(silhouettes, options);
  statistics_ = builder_.statistics();
  if (statistics_.reused && is_builders_ && welded_ == weld_distance) return hull_;
  is_builders_ = false;  // until all of the following is done
  hull_ = built;
  for (HullFace& face : hull_.faces)
    if (face.view >= 0)
      face.edge = real_edge(used_[static_cast<std::size_t>(face.view)], face.edge);
  weld_vertices(hull_, weld_distance);
  welded_ = weld_distance;
  is_builders_ = true;
  return hull_;
}

std::vector<Silhouette> HullStage::silhouettes() const {
  std::vector<Silhouette> silhouettes;
  for (std::size_t i = 0; i < views_.size(); ++i)
    silhouettes.push_back({&views_[i]->camera, &used_[i].ideal->rings});
  return silhouettes;
}

Hull HullStage::rebuilt(const HullOptions& options, std::span<const std::size_t> lost) const {
  std::vector<Silhouette> left = silhouettes();
  for (auto view = lost.rbegin(); view != lost.rend(); ++view)
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(*view));
  return HullBuilder().build(left, options);
}

CameraDoubts HullStage::doubts(Unseen unseen, int points, std::uint32_t round) const {
  return find_doubts(silhouettes(), unseen, points, round);
}

std::vector<Tangency> HullStage::tangencies(std::size_t most_pairs, std::uint32_t round) const {
  return find_tangencies(silhouettes(), most_pairs, round);
}

}  // namespace polyhull
