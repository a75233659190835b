// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/stage.h"

#include "base/stopwatch.h"
#include "hull/weld.h"

namespace polyhull {

const UndistortedRings& HullStage::undistorted(const CameraContours& view) {
  const auto [place, is_new] = contours_.try_emplace(view.camera->name);
  Contours& known = place->second;
  if (is_new || known.real != *view.rings || known.camera != *view.camera) {
    known.camera = *view.camera;
    known.real = *view.rings;
    known.ideal = undistort_rings(*view.camera, known.real);
  }
  return known.ideal;
}

const Hull& HullStage::build(std::span<const CameraContours> views, const HullOptions& options,
                             double weld_distance) {
  const Stopwatch watch;
  std::vector<const UndistortedRings*> contours;
  std::vector<Silhouette> silhouettes;
  int with_foreground = 0;
  for (const CameraContours& view : views) {
    contours.push_back(&undistorted(view));
    silhouettes.push_back({view.camera, &contours.back()->rings});
    with_foreground += !view.rings->empty();
  }
  seconds_undistort_ = watch.seconds();
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
    if (face.view >= 0) face.edge = contours[static_cast<std::size_t>(face.view)]->source[face.edge];
  weld_vertices(hull_, weld_distance);
  welded_ = weld_distance;
  is_builders_ = true;
  return hull_;
}

}  // namespace polyhull
