// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The booleans of cgal_hull.h for one kernel; included by one source file per kernel, because each
/// takes a compiler half a minute.
#pragma once

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <chrono>
#include <map>

#include "support/cgal_hull.h"

namespace polyhull::test {

/// The triangles of the even-odd inside of \p rings, as indices into its points.
inline std::vector<std::array<std::uint32_t, 3>> triangulate_region(const Rings& rings) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Vertex = CGAL::Triangulation_vertex_base_with_info_2<std::uint32_t, Kernel>;
  using Face = CGAL::Constrained_triangulation_face_base_2<Kernel>;
  using Triangulation = CGAL::Constrained_Delaunay_triangulation_2<
      Kernel, CGAL::Triangulation_data_structure_2<Vertex, Face>>;
  Triangulation triangulation;
  std::vector<Triangulation::Vertex_handle> handles;
  for (const Vec2f& p : rings.points) {
    handles.push_back(triangulation.insert(Kernel::Point_2(p.x, p.y)));
    handles.back()->info() = static_cast<std::uint32_t>(handles.size() - 1);
  }
  for (std::size_t r = 0, begin = 0; r < rings.size(); begin = rings.ends[r++]) {
    for (std::size_t i = begin; i < rings.ends[r]; ++i) {
      const auto next = handles[i + 1 == rings.ends[r] ? begin : i + 1];
      // The same point twice is no edge; a build without CGAL's checks crashes on it.
      if (next != handles[i]) triangulation.insert_constraint(handles[i], next);
    }
  }
  // Nesting: walk from the outside; each constraint crossed turns inside and outside round.
  std::map<Triangulation::Face_handle, int> depth{{triangulation.infinite_face(), 0}};
  std::vector<Triangulation::Face_handle> queue{triangulation.infinite_face()};
  for (std::size_t at = 0; at < queue.size(); ++at) {
    const auto face = queue[at];
    for (int k = 0; k < 3; ++k) {
      const int crossed = depth[face] + (triangulation.is_constrained({face, k}) ? 1 : 0);
      if (depth.emplace(face->neighbor(k), crossed).second) queue.push_back(face->neighbor(k));
    }
  }
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (auto face = triangulation.finite_faces_begin(); face != triangulation.finite_faces_end();
       ++face) {
    if (depth[face] % 2 == 0) continue;
    triangles.push_back(
        {face->vertex(0)->info(), face->vertex(1)->info(), face->vertex(2)->info()});
  }
  return triangles;
}

template <class Kernel>
using CgalMesh = CGAL::Surface_mesh<typename Kernel::Point_3>;

/// The cone of \p silhouette between two depths, outside seen counter-clockwise.
template <class Kernel>
CgalMesh<Kernel> cgal_cone(const Silhouette& silhouette, double near, double far) {
  using Point = typename Kernel::Point_3;
  using Number = typename Kernel::FT;
  CgalMesh<Kernel> mesh;
  const Rings& rings = *silhouette.rings;
  const Vec3 C = silhouette.camera->centre();
  std::vector<typename CgalMesh<Kernel>::Vertex_index> front, back;
  for (const Vec2f& p : rings.points) {
    const Vec3 d = silhouette.camera->ray(Vec2(p));
    const auto at = [&](double depth) {
      const auto along = [&](int k) { return Number(C[k]) + Number(depth) * Number(d[k]); };
      return Point(along(0), along(1), along(2));
    };
    front.push_back(mesh.add_vertex(at(near)));
    back.push_back(mesh.add_vertex(at(far)));
  }
  for (const auto& t : triangulate_region(rings)) {
    // Counter-clockwise in (u, v), that is, clockwise on screen: seen from behind.
    mesh.add_face(back[t[0]], back[t[1]], back[t[2]]);
    mesh.add_face(front[t[0]], front[t[2]], front[t[1]]);
  }
  for (std::size_t r = 0, begin = 0; r < rings.size(); begin = rings.ends[r++]) {
    for (std::size_t i = begin; i < rings.ends[r]; ++i) {
      const std::size_t j = i + 1 == rings.ends[r] ? begin : i + 1;
      // The outside is on the right of the edge as seen on screen.
      mesh.add_face(front[i], back[j], front[j]);
      mesh.add_face(front[i], back[i], back[j]);
    }
  }
  return mesh;
}

template <class Kernel>
CgalMesh<Kernel> cgal_box(const Bounds& box) {
  using Point = typename Kernel::Point_3;
  CgalMesh<Kernel> mesh;
  std::vector<typename CgalMesh<Kernel>::Vertex_index> v;
  for (int i = 0; i < 8; ++i) {
    v.push_back(mesh.add_vertex(Point(i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y,
                                      i & 4 ? box.max.z : box.min.z)));
  }
  const int quads[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                           {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& q : quads) {
    mesh.add_face(v[q[0]], v[q[1]], v[q[2]]);
    mesh.add_face(v[q[0]], v[q[2]], v[q[3]]);
  }
  return mesh;
}

template <class Kernel>
CgalHull cgal_hull(std::span<const Silhouette> silhouettes, const std::optional<Bounds>& bounds,
                   double near, double far) {
  namespace pmp = CGAL::Polygon_mesh_processing;
  CgalHull result;
  std::vector<CgalMesh<Kernel>> cones;
  for (const Silhouette& silhouette : silhouettes)
    cones.push_back(cgal_cone<Kernel>(silhouette, near, far));
  if (bounds) cones.push_back(cgal_box<Kernel>(*bounds));
  const auto begin = std::chrono::steady_clock::now();
  // In pairs, their results in pairs again: edges that one boolean leaves inside a face are cut by
  // all after it, so a chain of booleans takes several times longer.
  while (cones.size() > 1) {
    std::vector<CgalMesh<Kernel>> both;
    for (std::size_t i = 0; i + 1 < cones.size(); i += 2) {
      both.emplace_back();
      if (!pmp::corefine_and_compute_intersection(cones[i], cones[i + 1], both.back()))
        return result;
      both.back().collect_garbage();
    }
    if (cones.size() % 2 == 1) both.push_back(std::move(cones.back()));
    cones = std::move(both);
  }
  const CgalMesh<Kernel> mesh = cones.empty() ? CgalMesh<Kernel>() : std::move(cones.front());
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  result.done = true;
  for (auto v : mesh.vertices()) {
    const auto& p = mesh.point(v);
    result.vertices.emplace_back(CGAL::to_double(p.x()), CGAL::to_double(p.y()),
                                 CGAL::to_double(p.z()));
  }
  for (auto f : mesh.faces()) {
    std::array<std::uint32_t, 3> triangle{};
    int k = 0;
    for (auto v : mesh.vertices_around_face(mesh.halfedge(f)))
      triangle[k++] = static_cast<std::uint32_t>(v);
    result.triangles.push_back(triangle);
  }
  if (!mesh.is_empty()) result.volume = CGAL::to_double(pmp::volume(mesh));
  return result;
}

}  // namespace polyhull::test
