// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/drawable.h"

#include <cmath>

#include "base/error.h"

namespace polyhull {
namespace {

/// Beyond, single precision no longer tells a person's parts from each other, and squares overflow.
constexpr float most = 1e9f;

bool not_below_0(const Vec3f& v) {
  return v.x >= 0.0f && v.y >= 0.0f && v.z >= 0.0f;
}

/// A right angle and a little, as programs round it.
constexpr float widest_cone = 1.5709f;

bool is_cone(const Light& light) {
  return light.inner_cone >= 0.0f && light.inner_cone <= light.outer_cone &&
         light.outer_cone <= widest_cone;
}

/// A product of matrices may have rounded it.
bool has_form(const Mat3& K) {
  constexpr double rounded = 1e-9;
  return std::abs(K[0][1]) <= rounded && std::abs(K[0][2]) <= rounded &&
         std::abs(K[1][2]) <= rounded && std::abs(K[2][2] - 1.0) <= rounded;
}

}  // namespace

bool within_reach(const Vec3f& v) {
  return std::abs(v.x) <= most && std::abs(v.y) <= most && std::abs(v.z) <= most;
}

bool is_beyond(const Light& light, const Bounds& bounds, double sizes) {
  return glm::distance(Vec3(light.centre), 0.5 * (bounds.min + bounds.max)) >
         sizes * glm::distance(bounds.min, bounds.max);
}

void check_viewport(const Camera& camera) {
  bool finite = camera.width > 0 && camera.height > 0;
  for (int i = 0; i < 3; ++i) {
    finite = finite && std::isfinite(camera.t[i]);
    for (int j = 0; j < 3; ++j)
      finite = finite && std::isfinite(camera.R[i][j]) && std::isfinite(camera.K[i][j]);
  }
  if (finite && has_form(camera.K) && std::abs(camera.K[0][0]) >= 1e-9 &&
      std::abs(camera.K[1][1]) >= 1e-9 && std::abs(glm::determinant(camera.R) - 1.0) <= 1e-3)
    return;
  throw Error(Error::Kind::bad_input,
              "The viewport camera is not usable: it needs a size, K = [f s c; 0 f c; 0 0 1] with "
              "a focal length f other than zero, a rotation, and only finite numbers.");
}

void check_projection(const Camera& camera) {
  constexpr double least = 1e-4, most = 1e5;
  const double sides[] = {1.0 * camera.width, 1.0 * camera.height};
  for (int i = 0; i < 2; ++i) {
    const double focal = camera.K[i][i] / sides[i], centre = camera.K[2][i] / sides[i];
    if (!(focal >= least && focal <= most && std::abs(centre) <= most))
      throw Error(
          Error::Kind::bad_input,
          "The viewport's focal lengths in 'K' must be from {:g} to {:g} times the picture's width "
          "and height, and the principal point no farther away.",
          least, most);
  }
  if (!(std::abs(camera.K[1][0]) <= most * sides[0]))
    throw Error(Error::Kind::bad_input, "The viewport's skew in 'K' is out of range.");
}

void check_light(const std::vector<Light>& lights, float exposure, const Vec3f& ambient,
                 const Vec3f& sky) {
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const Light& light = lights[i];
    if (within_reach(light.centre) && within_reach(light.u) && within_reach(light.v) &&
        not_below_0(light.radiance) && is_cone(light) &&
        std::isfinite(light.radiance.x + light.radiance.y + light.radiance.z))
      continue;
    throw Error(Error::Kind::bad_input,
                "Light {} of the scene cannot be used: its centre, u and v must be finite and at "
                "most {:g} m, its radiance finite and not below 0, a spot's cone from 0 to a right "
                "angle and the inner one not wider than the outer one.",
                i, most);
  }
  if (!(exposure >= 0.0f && exposure <= most) || !within_reach(ambient) || !not_below_0(ambient) ||
      !within_reach(sky) || !not_below_0(sky))
    throw Error(Error::Kind::bad_input,
                "The scene's exposure ({:g}), ambient light and sky must be from 0 to {:g}.",
                exposure, most);
}

}  // namespace polyhull
