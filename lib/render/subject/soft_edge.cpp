// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/subject/soft_edge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace polyhull {
namespace {

/// An edge between a triangle that faces the eye and one that does not, in the former's direction.
struct OutlineEdge {
  std::uint32_t from, to;
};

std::vector<OutlineEdge> outline_of(const Hull& hull, const Vec3f& eye) {
  // Half edges of the triangles that face the eye, by their first vertex; one whose opposite is
  // among them too is inside.
  const std::size_t count = hull.triangles.size() / 3;
  std::vector<std::uint8_t> faces(count);
  std::vector<std::uint32_t> first(hull.vertices.size() + 1, 0);
  for (std::size_t f = 0; f < count; ++f) {
    const std::uint32_t* v = &hull.triangles[3 * f];
    const Vec3f& a = hull.vertices[v[0]];
    const Vec3f cross = glm::cross(hull.vertices[v[1]] - a, hull.vertices[v[2]] - a);
    faces[f] = glm::dot(cross, eye - a) > 0.0f;
    for (int k = 0; faces[f] && k < 3; ++k) ++first[v[k] + 1];
  }
  for (std::size_t v = 0; v + 1 < first.size(); ++v) first[v + 1] += first[v];
  std::vector<std::uint32_t> ends(first.back());
  std::vector<std::uint32_t> filled(first.begin(), first.end() - 1);
  for (std::size_t f = 0; f < count; ++f) {
    const std::uint32_t* v = &hull.triangles[3 * f];
    for (int k = 0; faces[f] && k < 3; ++k) ends[filled[v[k]]++] = v[(k + 1) % 3];
  }
  std::vector<OutlineEdge> edges;
  for (std::uint32_t v = 0; v + 1 < first.size(); ++v) {
    for (std::uint32_t i = first[v]; i < first[v + 1]; ++i) {
      const std::uint32_t w = ends[i];
      const auto* begin = ends.data() + first[w];
      const auto* end = ends.data() + first[w + 1];
      if (std::find(begin, end, v) == end) edges.push_back({v, w});
    }
  }
  return edges;
}

/// The views that count at a ribbon, and how much at its points.
class NearViews {
 public:
  NearViews(const Mesh& mesh, const Vec3f& eye) : mesh_(mesh), eye_(eye) {
    for (const MeshView& view : mesh.views)
      centres_.emplace_back(view.calibration.centre() - mesh.hull.origin);
  }

  float weight(std::size_t view, const Vec3f& p) const {
    const float cosine = glm::dot(glm::normalize(centres_[view] - p), glm::normalize(eye_ - p));
    const float square = std::max(cosine, 0.0f) * std::max(cosine, 0.0f);
    return square * square * square * square;
  }

  /// Up to four, the heaviest at \p p first.
  std::vector<std::size_t> at(const Vec3f& p) const {
    std::vector<std::pair<float, std::size_t>> ranked;
    for (std::size_t k = 0; k < centres_.size(); ++k) {
      if (!can_colour(mesh_.views[k].view)) continue;
      const float w = weight(k, p);
      if (w > 1e-4f) ranked.emplace_back(-w, k);
    }
    std::sort(ranked.begin(), ranked.end());
    std::vector<std::size_t> out;
    for (std::size_t i = 0; i < std::min<std::size_t>(ranked.size(), 4); ++i)
      out.push_back(ranked[i].second);
    return out;
  }

 private:
  const Mesh& mesh_;
  Vec3f eye_;
  std::vector<Vec3f> centres_;
};

/// The mean size of the views' pixels at \p p (relative to the hull's origin), world units.
float pixel_size(const Mesh& mesh, const Vec3f& p) {
  double sum = 0.0;
  int count = 0;
  for (const MeshView& view : mesh.views) {
    if (!can_colour(view.view)) continue;
    sum += std::abs(view.calibration.to_camera(mesh.hull.origin + Vec3(p)).z /
                    view.calibration.K[0][0]);
    ++count;
  }
  return count > 0 ? static_cast<float>(sum / count) : 0.0f;
}

}  // namespace

double longest_reach(const Mesh& mesh) {
  double longest = 0.0;
  for (const MeshView& view : mesh.views) {
    if (!can_colour(view.view)) continue;
    for (const Vec3f& v : mesh.hull.vertices)
      longest =
          std::max(longest, std::abs(view.calibration.to_camera(mesh.hull.origin + Vec3(v)).z /
                                     view.calibration.K[0][0]));
  }
  return edge_reach * longest;
}

double inset_depth(const OcclusionMap& map, double focal) {
  return edge_inset * map.far / focal / (map.far - map.near);
}

std::vector<float> rim_shares(const Mesh& mesh, const Vec3& eye, bool soft) {
  // So that a surface seen by one camera only is not left grey.
  constexpr float least = 0.002f;
  std::vector<float> shares(mesh.views.size(), least);
  if (!soft || mesh.hull.vertices.empty()) return shares;
  Vec3 low(mesh.hull.vertices.front()), high = low;
  for (const Vec3f& v : mesh.hull.vertices) {
    low = glm::min(low, Vec3(v));
    high = glm::max(high, Vec3(v));
  }
  const Vec3 middle = mesh.hull.origin + 0.5 * (low + high);
  constexpr double wide = 0.2;  // radians within which a rim counts more
  for (std::size_t k = 0; k < shares.size(); ++k) {
    const Vec3 centre = mesh.views[k].calibration.centre();
    const double cosine = glm::dot(glm::normalize(centre - middle), glm::normalize(eye - middle));
    const double off = std::acos(std::clamp(cosine, -1.0, 1.0)) / wide;
    const double near = std::clamp(1.0 - off, 0.0, 1.0);
    shares[k] = least + static_cast<float>(near * near);
  }
  return shares;
}

void draw_in(const Mesh& mesh, std::size_t first, HullDrawing& drawing) {
  const Hull& hull = mesh.hull;
  if (!mesh.texturing || mesh.texturing->normals.size() != hull.vertices.size()) return;
  for (std::size_t i = first; i < drawing.vertices.size(); ++i) {
    const std::uint32_t v = drawing.corner[i];
    const float by = static_cast<float>(edge_inset) * pixel_size(mesh, hull.vertices[v]);
    drawing.vertices[i].position = hull.vertices[v] - by * mesh.texturing->normals[v];
  }
}

void add_ribbons(const Mesh& mesh, const Vec3& eye, HullDrawing& drawing) {
  const Hull& hull = mesh.hull;
  const Vec3f from(eye - hull.origin);
  const std::vector<OutlineEdge> edges = outline_of(hull, from);
  // The way out at a vertex: the mean of its edges', straight across the line of sight.
  std::vector<Vec3f> out(hull.vertices.size(), Vec3f(0.0f));
  for (const OutlineEdge& edge : edges) {
    const Vec3f &a = hull.vertices[edge.from], &b = hull.vertices[edge.to];
    const Vec3f across = glm::cross(b - a, from - a);
    const float length = glm::length(across);
    if (!(length > 0.0f)) continue;
    out[edge.from] += across * (1.0f / length);
    out[edge.to] += across * (1.0f / length);
  }
  const NearViews near(mesh, from);
  const VertexFill fill(mesh);
  for (const OutlineEdge& edge : edges) {
    const std::uint32_t ends[2] = {edge.from, edge.to};
    const std::vector<std::size_t> views =
        near.at(0.5f * (hull.vertices[edge.from] + hull.vertices[edge.to]));
    if (views.empty()) continue;
    HullVertex corner[2][2];  // inner and outer, of both ends
    for (int e = 0; e < 2; ++e) {
      const Vec3f& p = hull.vertices[ends[e]];
      const float length = glm::length(out[ends[e]]);
      const Vec3f way = length > 0.0f ? out[ends[e]] * (1.0f / length) : Vec3f(0.0f);
      const float pixel = pixel_size(mesh, p);
      corner[e][0].position = p - static_cast<float>(2.0 * edge_inset) * pixel * way;
      corner[e][1].position = p + static_cast<float>(edge_reach) * pixel * way;
      for (HullVertex& vertex : corner[e]) {
        vertex.fill = fill(ends[e]);
        for (std::size_t i = 0; i < 4; ++i) {
          const std::size_t view = views[std::min(i, views.size() - 1)];
          vertex.slots[i] = static_cast<std::uint8_t>(slot_of(drawing, view));
          if (i < views.size())
            vertex.weights[i] = static_cast<std::uint16_t>(
                std::lround(65535.0f * std::clamp(near.weight(view, p), 0.0f, 1.0f)));
        }
      }
    }
    for (const auto& [e, side] : {std::pair{0, 0}, {0, 1}, {1, 1}, {0, 0}, {1, 1}, {1, 0}}) {
      drawing.vertices.push_back(corner[e][side]);
      drawing.corner.push_back(ends[e]);
    }
  }
}

}  // namespace polyhull
