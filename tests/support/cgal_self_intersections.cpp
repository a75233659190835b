// SPDX-License-Identifier: LGPL-2.1-or-later
#include "support/cgal_self_intersections.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <utility>
#include <vector>

namespace polyhull::test {

std::size_t count_self_intersections(const Hull& hull) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
  Mesh mesh;
  std::vector<Mesh::Vertex_index> vertices;
  for (const Vec3f& v : hull.vertices)
    vertices.push_back(mesh.add_vertex({double(v.x), double(v.y), double(v.z)}));
  for (std::size_t t = 0; t + 2 < hull.triangles.size(); t += 3)
    mesh.add_face(vertices[hull.triangles[t]], vertices[hull.triangles[t + 1]],
                  vertices[hull.triangles[t + 2]]);
  std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> pairs;
  CGAL::Polygon_mesh_processing::self_intersections(mesh, std::back_inserter(pairs));
  return pairs.size();
}

}  // namespace polyhull::test
