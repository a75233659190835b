// SPDX-License-Identifier: LGPL-2.1-or-later
#include "builtin/default_rig.h"

#include <cmath>

namespace polyhull {

Rig default_rig() {
  // As polyhull-rig plan has it, turned so that two look from the front: cameras that face each
  // other would see the same outline twice, so none is within 40 degrees of that.
  struct Place {
    double degrees, height;
  };
  constexpr Place places[] = {{30.0, 1.4}, {120.0, 1.5}, {250.0, 1.35}, {340.0, 1.45}};
  constexpr double distance = 3.0;
  const Vec3 target(0.0, 0.95, 0.0);
  Rig rig;
  for (const Place& place : places) {
    Camera camera;
    camera.name = "cam" + std::to_string(rig.cameras.size());
    camera.width = 1024;
    camera.height = 768;
    camera.K = from_rows({700.0, 0.0, 511.5, 0.0, 700.0, 383.5, 0.0, 0.0, 1.0});
    const double angle = glm::radians(place.degrees);
    const Vec3 centre(distance * std::sin(angle), place.height, distance * std::cos(angle));
    const Vec3 forward = glm::normalize(target - centre);
    const Vec3 right = glm::normalize(glm::cross(forward, Vec3(0.0, 1.0, 0.0)));
    const Vec3 down = glm::cross(forward, right);
    camera.R = glm::transpose(Mat3(right, down, forward));
    camera.t = -(camera.R * centre);
    rig.cameras.push_back(camera);
  }
  rig.bounds = Bounds{Vec3(-1.2, 0.0, -1.2), Vec3(1.2, 2.3, 1.2)};
  return rig;
}

Rig open_rig(const std::string& path) {
  return path.empty() ? default_rig() : load_rig(path);
}

}  // namespace polyhull
