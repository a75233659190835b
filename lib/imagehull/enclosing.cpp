// SPDX-License-Identifier: LGPL-2.1-or-later
#include "imagehull/enclosing.h"

#include <algorithm>
#include <cmath>

namespace polyhull {
namespace {

constexpr std::size_t most_views = 8;

/// The positive side counts.
struct Plane {
  Vec3 normal{0.0};
  double offset = 0.0;
  double at(const Vec3& p) const { return glm::dot(normal, p) + offset; }
};

void add_pyramid(const Silhouette& view, const Vec3& middle, double size,
                 std::vector<Plane>& planes) {
  Vec2f low(INFINITY), high(-INFINITY);
  for (const Vec2f& p : view.rings->points) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const Mat3 rows = glm::transpose(view.camera->K * view.camera->R);  // columns are its rows
  const Vec3 centre = (view.camera->centre() - middle) / size;
  for (int axis = 0; axis < 2; ++axis) {
    // Half a pixel more: nothing of the hull is lost to rounding.
    const Vec3 sides[] = {rows[axis] - (low[axis] - 0.5) * rows[2],
                          (high[axis] + 0.5) * rows[2] - rows[axis]};
    for (const Vec3& side : sides) {
      const Vec3 normal = glm::normalize(side);
      planes.push_back({normal, -glm::dot(normal, centre)});
    }
  }
}

}  // namespace

std::vector<Vec3> enclosing_corners(std::span<const Silhouette> views) {
  Vec3 middle(0.0);
  for (const Silhouette& view : views)
    middle += view.camera->centre() / static_cast<double>(views.size());
  double size = 0.0;
  for (const Silhouette& view : views)
    size = std::max(size, glm::distance(view.camera->centre(), middle));
  if (!(size > 0.0)) size = 1.0;

  // In units of the rig's size around its middle.
  constexpr double far = 1024.0;
  std::vector<Plane> planes;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      Plane plane;
      plane.normal[axis] = sign;
      plane.offset = far;
      planes.push_back(plane);
    }
  const std::size_t used = std::min(views.size(), most_views);
  for (std::size_t i = 0; i < used; ++i)
    add_pyramid(views[i * views.size() / used], middle, size, planes);

  std::vector<Vec3> corners;
  for (std::size_t a = 0; a < planes.size(); ++a)
    for (std::size_t b = a + 1; b < planes.size(); ++b) {
      const Vec3 along = glm::cross(planes[a].normal, planes[b].normal);
      for (std::size_t c = b + 1; c < planes.size(); ++c) {
        const double volume = glm::dot(along, planes[c].normal);
        if (std::abs(volume) < 1e-9) continue;
        const Vec3 corner = -(planes[a].offset * glm::cross(planes[b].normal, planes[c].normal) +
                              planes[b].offset * glm::cross(planes[c].normal, planes[a].normal) +
                              planes[c].offset * along) /
                            volume;
        const double tolerance = 1e-7 * (1.0 + glm::length(corner));
        if (std::all_of(planes.begin(), planes.end(),
                        [&](const Plane& plane) { return plane.at(corner) > -tolerance; }))
          corners.push_back(middle + size * corner);
      }
    }
  if (corners.size() < 4) corners.clear();
  return corners;
}

}  // namespace polyhull
