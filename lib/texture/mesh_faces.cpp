// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/mesh_faces.h"

#include <algorithm>

#include "base/thread_pool.h"

namespace polyhull {

MeshFaces find_faces(const Hull& hull, int threads) {
  const std::size_t count = hull.triangles.size() / 3;
  MeshFaces out;
  for (auto* numbers : {&out.nx, &out.ny, &out.nz, &out.mx, &out.my, &out.mz, &out.area})
    numbers->resize(count);
  parallel_each(count, 4096, threads, [&](std::size_t f) {
    const Vec3 a(hull.vertices[hull.triangles[3 * f]]);
    const Vec3 b(hull.vertices[hull.triangles[3 * f + 1]]);
    const Vec3 c(hull.vertices[hull.triangles[3 * f + 2]]);
    const Vec3 cross = glm::cross(b - a, c - a), middle = (a + b + c) / 3.0;
    const double area = glm::length(cross);
    const Vec3f normal(area > 0.0 ? cross / area : Vec3(0.0));
    out.nx[f] = normal.x, out.ny[f] = normal.y, out.nz[f] = normal.z;
    out.mx[f] = static_cast<float>(middle.x);
    out.my[f] = static_cast<float>(middle.y);
    out.mz[f] = static_cast<float>(middle.z);
    out.area[f] = static_cast<float>(area);
  });
  out.view.assign(count, -1);
  for (const HullFace& face : hull.faces) {
    const std::size_t end = std::min<std::size_t>(
        static_cast<std::size_t>(face.first_triangle) + face.triangle_count, count);
    for (std::size_t f = face.first_triangle; f < end; ++f) out.view[f] = face.view;
  }
  return out;
}

}  // namespace polyhull
