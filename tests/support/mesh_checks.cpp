// SPDX-License-Identifier: LGPL-2.1-or-later
#include "support/mesh_checks.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>
#include <vector>

namespace polyhull::test {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// How many directed edges lack exactly one partner; \p edges is sorted on the way.
std::size_t count_unpaired(std::vector<Edge>& edges) {
  std::sort(edges.begin(), edges.end());
  std::size_t unpaired = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const bool twice =
        (i > 0 && edges[i] == edges[i - 1]) || (i + 1 < edges.size() && edges[i] == edges[i + 1]);
    const Edge back{edges[i].second, edges[i].first};
    if (twice || !std::binary_search(edges.begin(), edges.end(), back)) ++unpaired;
  }
  return unpaired;
}

/// Vertices whose corner triangles do not form one closed fan, and vertices without triangles.
void check_fans(const Hull& hull, MeshReport& report) {
  const std::size_t n = hull.vertices.size();
  std::vector<std::uint32_t> start(n + 1, 0);
  for (std::uint32_t v : hull.triangles) ++start[v + 1];
  for (std::size_t v = 0; v < n; ++v) start[v + 1] += start[v];
  std::vector<Edge> spokes(hull.triangles.size());
  std::vector<std::uint32_t> fill(start.begin(), start.end() - 1);
  for (std::size_t t = 0; t < hull.triangles.size(); t += 3) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t v = hull.triangles[t + k];
      spokes[fill[v]++] = {hull.triangles[t + (k + 1) % 3], hull.triangles[t + (k + 2) % 3]};
    }
  }
  for (std::size_t v = 0; v < n; ++v) {
    const auto begin = spokes.begin() + start[v], end = spokes.begin() + start[v + 1];
    if (begin == end) {
      ++report.unused_vertices;
      continue;
    }
    std::sort(begin, end);
    std::uint32_t at = begin->first;
    std::ptrdiff_t steps = 0;
    do {
      const auto next = std::lower_bound(begin, end, Edge{at, 0});
      if (next == end || next->first != at) break;
      at = next->second;
      ++steps;
    } while (at != begin->first && steps <= end - begin);
    if (at != begin->first || steps != end - begin) ++report.split_vertices;
  }
}

void measure_triangles(const Hull& hull, MeshReport& report) {
  for (std::size_t t = 0; t < hull.triangles.size(); t += 3) {
    const std::uint32_t i = hull.triangles[t], j = hull.triangles[t + 1], k = hull.triangles[t + 2];
    if (i == j || j == k || k == i) {
      ++report.repeated_corners;
      continue;
    }
    const Vec3 a(hull.vertices[i]), b(hull.vertices[j]), c(hull.vertices[k]);
    report.volume += glm::dot(a, glm::cross(b, c)) / 6.0;
    const double area = glm::length(glm::cross(b - a, c - a));
    const double longest = std::max({glm::length(b - a), glm::length(c - a), glm::length(c - b)});
    if (!(area > 0.0)) ++report.flat_triangles;
    if (!(area >= 2e-3 * longest * longest)) ++report.slivers;
  }
}

/// The boundary of each face's triangles must be its loops, and the loops must pair up.
std::string check_loops(const Hull& hull) {
  const auto say = [](const char* what, std::size_t face) {
    std::ostringstream text;
    text << what << " (face " << face << ")";
    return text.str();
  };
  if (hull.faces.size() == 1 && hull.faces[0].edge == HullFace::no_edge)  // a smooth surface
    return hull.faces[0].triangle_count == hull.triangles.size() / 3 && hull.loop_ends.empty()
               ? ""
               : "a surface of no planes with other faces";
  if (hull.face_loop_ends.size() != hull.faces.size())
    return "face_loop_ends has another length than faces";
  if (!hull.face_loop_ends.empty() && hull.face_loop_ends.back() != hull.loop_ends.size()) {
    return "the last face does not end with the last loop";
  }
  if (!hull.loop_ends.empty() && hull.loop_ends.back() != hull.loop_vertices.size()) {
    return "the last loop does not end with the last loop vertex";
  }
  std::vector<Edge> all, boundary, sides;
  std::size_t triangle = 0, loop = 0, corner = 0;
  for (std::size_t f = 0; f < hull.faces.size(); ++f) {
    const HullFace& face = hull.faces[f];
    if (face.first_triangle != triangle || face.triangle_count == 0) {
      return say("triangles are not grouped by face", f);
    }
    triangle += face.triangle_count;
    if (triangle * 3 > hull.triangles.size())
      return say("a face has more triangles than there are", f);
    sides.clear();
    for (std::size_t t = face.first_triangle; t < triangle; ++t) {
      for (int k = 0; k < 3; ++k) {
        sides.emplace_back(hull.triangles[t * 3 + k], hull.triangles[t * 3 + (k + 1) % 3]);
      }
    }
    std::sort(sides.begin(), sides.end());
    boundary.clear();
    if (hull.face_loop_ends[f] <= loop) return say("a face without a loop", f);
    for (; loop < hull.face_loop_ends[f]; ++loop) {
      const std::size_t end = hull.loop_ends[loop];
      if (end < corner + 3 || end > hull.loop_vertices.size())
        return say("a loop of fewer than three vertices", f);
      for (std::size_t i = corner; i < end; ++i) {
        const std::uint32_t a = hull.loop_vertices[i];
        const std::uint32_t b = hull.loop_vertices[i + 1 == end ? corner : i + 1];
        if (a >= hull.vertices.size()) return say("a loop vertex that does not exist", f);
        boundary.emplace_back(a, b);
      }
      corner = end;
    }
    std::sort(boundary.begin(), boundary.end());
    std::vector<Edge> open;
    for (const Edge& side : sides) {
      if (!std::binary_search(sides.begin(), sides.end(), Edge{side.second, side.first}))
        open.push_back(side);
    }
    if (open != boundary) return say("the triangles' boundary is not the face's loops", f);
    all.insert(all.end(), boundary.begin(), boundary.end());
  }
  if (triangle * 3 != hull.triangles.size()) return "triangles without a face";
  if (count_unpaired(all) != 0) return "loops of neighbouring faces do not pair up";
  return {};
}

template <class T>
bool equal_bytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

}  // namespace

std::string MeshReport::describe() const {
  std::ostringstream text;
  text << vertices << " vertices, " << triangles << " triangles, " << faces << " faces, volume "
       << volume;
  const auto tell = [&](std::size_t count, const char* what) {
    if (count != 0) text << ", " << count << " " << what;
  };
  tell(bad_indices, "indices out of range");
  tell(unpaired_edges, "unpaired edges");
  tell(split_vertices, "vertices of more than one fan");
  tell(unused_vertices, "unused vertices");
  tell(not_finite, "vertices that are not finite");
  tell(repeated_corners, "triangles that name a vertex twice");
  tell(flat_triangles, "triangles without area");
  tell(slivers, "slivers");
  if (!inconsistency.empty()) text << ", " << inconsistency;
  return text.str();
}

MeshReport check_mesh(const Hull& hull) {
  MeshReport report;
  report.vertices = hull.vertices.size();
  report.triangles = hull.triangles.size() / 3;
  report.faces = hull.faces.size();
  for (const Vec3f& v : hull.vertices) {
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) ++report.not_finite;
  }
  if (!std::isfinite(hull.origin.x + hull.origin.y + hull.origin.z)) ++report.not_finite;
  if (hull.triangles.size() % 3 != 0) ++report.bad_indices;
  for (std::uint32_t v : hull.triangles) report.bad_indices += v >= hull.vertices.size();
  if (report.bad_indices != 0) return report;
  std::vector<Edge> edges;
  edges.reserve(hull.triangles.size());
  for (std::size_t t = 0; t < hull.triangles.size(); t += 3) {
    for (int k = 0; k < 3; ++k)
      edges.emplace_back(hull.triangles[t + k], hull.triangles[t + (k + 1) % 3]);
  }
  report.unpaired_edges = count_unpaired(edges);
  check_fans(hull, report);
  measure_triangles(hull, report);
  report.inconsistency = check_loops(hull);
  return report;
}

PlaneReport check_planes(const Hull& hull, std::span<const Silhouette> silhouettes,
                         const HullOptions& options) {
  PlaneReport report;
  for (const HullFace& face : hull.faces) {
    Vec3 normal(0.0), through(0.0);
    bool outward_known = true;
    if (face.view < 0) {
      if (!options.bounds || face.edge > 5) {
        ++report.bad_source;
        continue;
      }
      normal[face.edge / 2] = face.edge % 2 ? 1.0 : -1.0;
      through = face.edge % 2 ? options.bounds->max : options.bounds->min;
    } else {
      const auto view = static_cast<std::size_t>(face.view);
      if (view >= silhouettes.size()) {
        ++report.bad_source;
        continue;
      }
      const Rings& rings = *silhouettes[view].rings;
      const Camera& camera = *silhouettes[view].camera;
      const std::size_t border = face.edge - std::min<std::size_t>(face.edge, rings.points.size());
      Vec2 p, q;
      if (face.edge < rings.points.size()) {
        const auto ring = std::upper_bound(rings.ends.begin(), rings.ends.end(), face.edge);
        const std::uint32_t first = ring == rings.ends.begin() ? 0 : *(ring - 1);
        p = Vec2(rings.points[face.edge]);
        q = Vec2(rings.points[face.edge + 1 == *ring ? first : face.edge + 1]);
      } else if (options.unseen == Unseen::keep && border < 4) {
        // The frame's border: top, right, bottom, left.
        const double right = camera.width - 0.5, bottom = camera.height - 0.5;
        const Vec2 corners[4] = {{-0.5, -0.5}, {right, -0.5}, {right, bottom}, {-0.5, bottom}};
        p = corners[border];
        q = corners[(border + 1) % 4];
        outward_known = false;
      } else {
        ++report.bad_source;
        continue;
      }
      normal = glm::cross(camera.ray(p), camera.ray(q));
      normal = glm::length(normal) > 0.0 ? glm::normalize(normal) : normal;
      through = camera.centre();
    }
    std::size_t forward = 0, backward = 0;
    double area = 0.0;
    for (std::size_t t = face.first_triangle; t < face.first_triangle + face.triangle_count; ++t) {
      const auto corner = [&](int k) { return Vec3(hull.vertices[hull.triangles[t * 3 + k]]); };
      const double twice =
          glm::dot(glm::cross(corner(1) - corner(0), corner(2) - corner(0)), normal);
      area += twice;
      if (twice > 0.0) ++forward;
      if (twice < 0.0) ++backward;
      for (int k = 0; k < 3; ++k) {
        const double distance = std::abs(glm::dot(hull.origin - through + corner(k), normal));
        report.worst_distance = std::max(report.worst_distance, distance);
      }
      ++report.checked;
    }
    report.flipped += area >= 0.0 ? backward : forward;
    // Rings of the conventions have the silhouette on their left, so normals point outward.
    if (area < 0.0 && outward_known) ++report.wrong_side;
  }
  return report;
}

bool pierces(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto volume = [](const Vec3& s, const Vec3& t, const Vec3& u, const Vec3& v) {
    return glm::dot(glm::cross(t - s, u - s), v - s);
  };
  if (volume(a, b, c, p) * volume(a, b, c, q) >= 0.0) return false;
  const double u = volume(p, q, a, b), v = volume(p, q, b, c), w = volume(p, q, c, a);
  return (u > 0.0 && v > 0.0 && w > 0.0) || (u < 0.0 && v < 0.0 && w < 0.0);
}

bool same_bytes(const Hull& a, const Hull& b) {
  return std::memcmp(&a.origin, &b.origin, sizeof a.origin) == 0 &&
         equal_bytes(a.vertices, b.vertices) && equal_bytes(a.triangles, b.triangles) &&
         equal_bytes(a.faces, b.faces) && equal_bytes(a.loop_vertices, b.loop_vertices) &&
         equal_bytes(a.loop_ends, b.loop_ends) && equal_bytes(a.face_loop_ends, b.face_loop_ends);
}

std::uint64_t fingerprint(const Hull& hull) {
  std::uint64_t hash = 1469598103934665603ull;  // FNV-1a
  const auto add = [&](const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) hash = (hash ^ bytes[i]) * 1099511628211ull;
  };
  const auto add_all = [&](const auto& values) {
    const std::uint64_t count = values.size();
    add(&count, sizeof count);
    if (!values.empty()) add(values.data(), values.size() * sizeof values[0]);
  };
  add(&hull.origin, sizeof hull.origin);
  add_all(hull.vertices);
  add_all(hull.triangles);
  add_all(hull.faces);
  add_all(hull.loop_vertices);
  add_all(hull.loop_ends);
  add_all(hull.face_loop_ends);
  return hash;
}

}  // namespace polyhull::test
