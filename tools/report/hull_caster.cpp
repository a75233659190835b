// SPDX-License-Identifier: LGPL-2.1-or-later
#include "report/hull_caster.h"

#include "base/thread_pool.h"
#include "rig/lens.h"

namespace polyhull::report {

HullCaster::HullCaster(const Hull& hull) : hull_(hull) {
  if (!hull.empty()) caster_.add_mesh(hull.vertices, hull.triangles);
  caster_.commit();
}

HitPicture HullCaster::cast(const Camera& camera) const {
  HitPicture picture{camera.width, camera.height, {}};
  picture.hits.resize(static_cast<std::size_t>(camera.width) * camera.height);
  const Vec3 origin = camera.centre() - hull_.origin;
  const Lens lens(camera);
  parallel_for(camera.height, 16, 0, [&](std::size_t begin, std::size_t end) {
    std::vector<Ray> rays(camera.width);
    for (std::size_t y = begin; y < end; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        rays[x].origin = origin;
        const Vec2 pixel(x, static_cast<double>(y));
        rays[x].direction = camera.ray(lens.active() ? lens.undistort(pixel) : pixel);
      }
      caster_.intersect(rays, std::span(picture.hits).subspan(y * camera.width, camera.width));
    }
  });
  return picture;
}

Vec3 HullCaster::position(const RayHit& hit) const {
  const std::uint32_t* corner = &hull_.triangles[3 * static_cast<std::size_t>(hit.triangle)];
  const Vec3 a = hull_.vertices[corner[0]];
  const Vec3 b = hull_.vertices[corner[1]];
  const Vec3 c = hull_.vertices[corner[2]];
  return hull_.origin + (1.0 - hit.u - hit.v) * a + static_cast<double>(hit.u) * b +
         static_cast<double>(hit.v) * c;
}

bool HullCaster::blocked(const Vec3& from, const Vec3& to) const {
  Ray ray;
  ray.origin = from - hull_.origin;
  ray.direction = to - from;
  ray.far = 1.0f;
  return caster_.occluded(ray);
}

}  // namespace polyhull::report
