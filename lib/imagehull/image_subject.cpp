// SPDX-License-Identifier: LGPL-2.1-or-later
#include "imagehull/image_subject.h"

#include <cmath>

#include "base/error.h"
#include "imagehull/sight_maps.h"
#include "rig/undistort.h"

namespace polyhull {
namespace {

/// The view but for its contours.
View without_contours(const View& view) {
  View out;
  out.camera = view.camera;
  out.trigger = view.trigger;
  out.capture_time = view.capture_time;
  out.width = view.width;
  out.height = view.height;
  out.roi = view.roi;
  out.format = view.format;
  out.stride = view.stride;
  out.pixels = view.pixels;
  return out;
}

/// Before a lens could make numbers of what is none.
void check_view(const View& view) {
  for (const Vec2f& point : view.contours.points)
    if (!std::isfinite(point.x) || !std::isfinite(point.y))
      throw Error(Error::Kind::bad_input,
                  "A contour of camera '{}' cannot be used: it is not finite.", view.camera);
}

}  // namespace

ImageSubject image_subject(const Mesh& mesh) {
  std::vector<UndistortedRings> rings;
  for (const MeshView& view : mesh.views) {
    check_view(view.view);
    rings.push_back(undistort_rings(view.calibration, view.view.contours));
  }
  std::vector<Silhouette> silhouettes;
  std::vector<std::uint8_t> wanted;
  for (std::size_t k = 0; k < mesh.views.size(); ++k) {
    silhouettes.push_back({&mesh.views[k].calibration, &rings[k].rings});
    wanted.push_back(!mesh.views[k].view.pixels.empty());
  }
  ImageSubject out{ImageHull(silhouettes), {}};
  out.mesh.trigger = mesh.trigger;
  out.mesh.capture_time = mesh.capture_time;
  out.mesh.up = mesh.up;
  out.mesh.metres_per_unit = mesh.metres_per_unit;
  for (const MeshView& view : mesh.views)
    out.mesh.views.push_back({view.calibration, without_contours(view.view)});
  if (!out.hull.empty()) {
    Vec3 middle(0.0);
    const std::vector<Vec3>& corners = out.hull.corners();
    for (const Vec3& corner : corners) middle += corner / static_cast<double>(corners.size());
    out.mesh.hull.origin = middle;
    for (const Vec3& corner : corners) out.mesh.hull.vertices.emplace_back(corner - middle);
  }
  Texturing& texturing = out.mesh.texturing.emplace();
  texturing.metric = TextureMetric::viewing_angle;
  if (mesh.texturing) {
    texturing.metric = mesh.texturing->metric;
    texturing.cameras =
        mesh.texturing->method == TextureMethod::direct ? 1 : mesh.texturing->cameras;
    texturing.untextured = mesh.texturing->untextured;
    texturing.gains = mesh.texturing->gains;
  }
  texturing.maps = sight_maps(out.hull, silhouettes, wanted);
  return out;
}

}  // namespace polyhull
