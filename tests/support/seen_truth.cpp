// SPDX-License-Identifier: LGPL-2.1-or-later
#include "seen_truth.h"

#include <algorithm>
#include <cmath>

#include "base/thread_pool.h"
#include "raytrace/ray_caster.h"
#include "studio/figure/figure.h"
#include "studio/figure/figure_skin.h"

namespace polyhull::test {
namespace {

/// Additive recurrence of the plastic number's powers (Roberts 2018), folded into the triangle.
Vec2 spread(int i) {
  const double u = std::fmod(0.5 + 0.7548776662466927 * i, 1.0);
  const double v = std::fmod(0.5 + 0.5698402909980532 * i, 1.0);
  return u + v > 1.0 ? Vec2(1.0 - u, 1.0 - v) : Vec2(u, v);
}

bool in_frame(const Camera& camera, const Vec3& point) {
  const auto pixel = camera.project(point);
  return pixel && pixel->x >= -0.5 && pixel->y >= -0.5 && pixel->x <= camera.width - 0.5 &&
         pixel->y <= camera.height - 0.5;
}

}  // namespace

Hull dense_body() {
  const Figure figure(make_figure_skin(0.0213f));
  SubjectFrame frame;
  figure.pose(3.0, frame);
  Hull hull;
  hull.vertices = frame.positions;
  hull.triangles = figure.triangles();
  return hull;
}

std::vector<float> seen_by_rays(const Hull& hull, std::span<const Camera> cameras) {
  RayCaster caster;
  caster.add_mesh(hull.vertices, hull.triangles);
  caster.commit();
  const std::size_t count = hull.triangles.size() / 3;
  std::vector<float> out(count * cameras.size(), 0.0f);
  parallel_for(out.size(), 256, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Camera& camera = cameras[i / count];
      const std::uint32_t* at = &hull.triangles[i % count * 3];
      const Vec3 a(hull.vertices[at[0]]), b(hull.vertices[at[1]]), c(hull.vertices[at[2]]);
      const Vec3 eye = camera.centre() - hull.origin, cross = glm::cross(b - a, c - a);
      const Vec3 normal = glm::normalize(cross);
      // Edge-on, as the faces of a view's own cone are, it has no picture.
      if (!(glm::dot(normal, glm::normalize(eye - (a + b + c) / 3.0)) > 1e-3)) continue;
      int free = 0, cast = 0;
      // Whether what is larger is seen in parts a few points do not tell.
      const int few = glm::length(cross) < 4e-4 ? 24 : 512;
      for (const int points : {few, 512}) {
        for (; cast < points; ++cast) {
          const Vec2 st = spread(cast);
          const Vec3 p = a + st.x * (b - a) + st.y * (c - a) + 1e-5 * normal;
          free += in_frame(camera, p + hull.origin) &&
                  !caster.occluded({Vec3f(p), 0.0f, Vec3f(eye - p), 1.0f});
        }
        if (free == 0 || free == cast) break;
      }
      out[i] = static_cast<float>(free) / static_cast<float>(cast);
    }
  });
  return out;
}

double agreement(const Hull& hull, std::size_t views, std::span<const float> truth,
                 const std::function<float(std::size_t view, std::size_t triangle)>& share) {
  const std::size_t count = hull.triangles.size() / 3;
  double wrong = 0.0, seen = 0.0;
  for (std::size_t f = 0; f < count; ++f) {
    const std::uint32_t* at = &hull.triangles[3 * f];
    const Vec3 a(hull.vertices[at[0]]), b(hull.vertices[at[1]]), c(hull.vertices[at[2]]);
    const double area = glm::length(glm::cross(b - a, c - a));
    for (std::size_t k = 0; k < views; ++k) {
      wrong += area * std::abs(share(k, f) - truth[k * count + f]);
      seen += area * truth[k * count + f];
    }
  }
  return 1.0 - wrong / seen;
}

}  // namespace polyhull::test
