// SPDX-License-Identifier: LGPL-2.1-or-later
// What the hull takes of a camera.
#include <cmath>

#include "base/error.h"
#include "hull/cones/cone.h"

namespace polyhull::hull {

ConeCamera read_camera(const Camera& camera, std::size_t index) {
  const auto fail = [&](const std::string& what) -> void {
    throw Error(Error::Kind::bad_input,
                "Camera '{}' (number {}) {}; check its K, R and t in the rig.", camera.name, index,
                what);
  };
  ConeCamera c;
  bool finite = true;
  for (int i = 0; i < 3; ++i) {
    finite = finite && std::isfinite(camera.t[i]);
    for (int k = 0; k < 3; ++k)
      finite = finite && std::isfinite(camera.K[i][k]) && std::isfinite(camera.R[i][k]);
  }
  if (!finite) fail("has a calibration that is not finite");
  const auto degenerate = [](const Mat3& m) {
    double product = 1.0;
    for (int i = 0; i < 3; ++i) product *= glm::length(m[i]);
    return !(std::abs(glm::determinant(m)) > 1e-12 * product) || product == 0.0;
  };
  if (degenerate(camera.K)) fail("has a degenerate matrix K");
  const double across = glm::length(camera.K[0]), down = glm::length(camera.K[1]);
  if (!(across <= 1e6 * down && down <= 1e6 * across))
    fail("has a matrix K whose focal lengths along x and y differ more than a million times");
  if (degenerate(camera.R)) fail("has a degenerate rotation R");
  c.to_pixel = camera.K * camera.R;
  const Mat3 inverse_rotation = glm::inverse(camera.R);
  c.to_ray = inverse_rotation * glm::inverse(camera.K);
  c.centre = -(inverse_rotation * camera.t);
  // Out of the picture: where the homogeneous pixel's third coordinate grows.
  c.forward = glm::normalize(Vec3(c.to_pixel[0][2], c.to_pixel[1][2], c.to_pixel[2][2]));
  c.width = camera.width;
  c.height = camera.height;
  if (!std::isfinite(c.centre.x + c.centre.y + c.centre.z) ||
      !std::isfinite(glm::determinant(c.to_ray)))
    fail("has a calibration beyond what numbers can hold");
  return c;
}

IntVec lattice_centre(const ConeCamera& camera, const Lattice& lattice) {
  const Vec3 c = (camera.centre - lattice.origin) * lattice.scale;
  return {std::llrint(c.x), std::llrint(c.y), std::llrint(c.z)};
}

}  // namespace polyhull::hull
