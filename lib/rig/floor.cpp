// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/floor.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace polyhull {

bool looks_down(const Rig& rig) {
  const double steep = std::sin(glm::radians(5.0));
  const Vec3 up = glm::normalize(rig.up);
  return std::all_of(rig.cameras.begin(), rig.cameras.end(), [&](const Camera& camera) {
    return glm::dot(glm::transpose(camera.R) * Vec3(0, 0, 1), up) <= -steep;
  });
}

const Camera* world_camera(const Rig& rig) {
  const auto found = std::find_if(rig.cameras.begin(), rig.cameras.end(), [](const Camera& camera) {
    return camera.R == Mat3(1.0) && camera.t == Vec3(0.0);
  });
  return found == rig.cameras.end() ? nullptr : &*found;
}

Vec3 triangulate(const Rig& rig, std::span<const std::pair<std::size_t, Vec2>> seen) {
  Mat3 normal(0.0);
  Vec3 right(0.0);
  for (const auto& [c, pixel] : seen) {
    const Camera& camera = rig.cameras.at(c);
    const Vec3 d = glm::normalize(camera.ray(camera.undistort(pixel)));
    const Mat3 across = Mat3(1.0) - glm::outerProduct(d, d);
    normal += across;
    right += across * camera.centre();
  }
  if (seen.size() < 2 || !(std::abs(glm::determinant(normal)) > 1e-9))
    throw Error(Error::Kind::bad_input,
                "A point on the floor must be seen by two cameras from different sides.");
  return glm::inverse(normal) * right;
}

Frame floor_frame(std::span<const Vec3> points, std::span<const Vec3> centres) {
  if (points.size() < 3)
    throw Error(Error::Kind::bad_input, "The floor needs 3 points; {} were given.", points.size());
  const Vec3 along = points[1] - points[0];
  // The normals of all triangles with the first point, by their areas, whatever the points' order;
  // for three points their cross product.
  std::vector<Vec3> normals;
  Vec3 largest(0.0);
  double reach = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    reach = std::max(reach, glm::length(points[i] - points[0]));
    for (std::size_t k = i + 1; k < points.size(); ++k) {
      normals.push_back(glm::cross(points[i] - points[0], points[k] - points[0]));
      if (glm::length(normals.back()) > glm::length(largest)) largest = normals.back();
    }
  }
  if (!(glm::length(largest) > 1e-3 * reach * reach) || !(glm::length(along) > 0.0))
    throw Error(Error::Kind::bad_input,
                "The floor's points lie on a line; take three that span a triangle.");
  Vec3 sum(0.0);
  for (const Vec3& normal : normals) sum += glm::dot(normal, largest) < 0.0 ? -normal : normal;
  Vec3 up = glm::normalize(sum);
  // Cameras stand above the floor.
  double height = 0.0;
  for (const Vec3& centre : centres) height += glm::dot(up, centre - points[0]);
  if (height < 0.0) up = -up;
  const Vec3 x = glm::normalize(along - glm::dot(along, up) * up);
  const Mat3 R = glm::transpose(Mat3(x, up, glm::cross(x, up)));
  return {R, -(R * points[0])};
}

Rig moved_rig(const Rig& rig, const Frame& frame) {
  Rig moved = rig;
  moved.bounds.reset();
  moved.up = Vec3(0, 1, 0);
  for (Camera& camera : moved.cameras) {
    // R F^T (x' - f) + t
    camera.R = camera.R * glm::transpose(frame.R);
    camera.t -= camera.R * frame.t;
  }
  return moved;
}

}  // namespace polyhull
