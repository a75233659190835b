// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/subject/hull_vertices.h"

#include <algorithm>
#include <cmath>

#include "base/srgb.h"

namespace polyhull {
namespace {

std::uint16_t fixed(float weight) {
  return static_cast<std::uint16_t>(65535.0f * std::clamp(weight, 0.0f, 1.0f) + 0.5f);
}

bool usable(const Mesh& mesh) {
  if (!mesh.texturing || mesh.views.empty() || mesh.views.size() > most_candidates) return false;
  const Texturing& texturing = *mesh.texturing;
  const std::size_t triangles = mesh.hull.triangles.size() / 3;
  return texturing.best.size() == triangles &&
         texturing.weights.size() == mesh.hull.vertices.size() * mesh.views.size() &&
         (texturing.metric == TextureMetric::camera_normal ||
          texturing.normals.size() == mesh.hull.vertices.size());
}

}  // namespace

bool can_colour(const View& view) {
  return view.format == PixelFormat::rgba && !view.roi.empty() && !view.pixels.empty();
}

VertexFill::VertexFill(const Mesh& mesh) {
  static const auto levels = [] {
    std::array<std::uint16_t, 256> of;
    for (int code = 0; code < 256; ++code)
      of[code] = fixed(srgb_to_linear(static_cast<std::uint8_t>(code)));
    return of;
  }();
  levels_ = levels.data();
  const Texturing* texturing = mesh.texturing ? &*mesh.texturing : nullptr;
  if (texturing && !texturing->fill.empty() && texturing->fill.size() == mesh.hull.vertices.size())
    colours_ = &texturing->fill;
  const Vec3f untextured = srgb_decoded(texturing ? texturing->untextured : Vec3f(0.5f));
  plain_ = {fixed(untextured.x), fixed(untextured.y), fixed(untextured.z), 0};
}

std::array<std::uint16_t, 4> VertexFill::operator()(std::uint32_t vertex) const {
  if (!colours_) return plain_;
  const std::uint32_t rgba = (*colours_)[vertex];
  return {levels_[rgba & 255], levels_[rgba >> 8 & 255], levels_[rgba >> 16 & 255], 0};
}

float fill_range(const Mesh& mesh) {
  return mesh.texturing && !mesh.texturing->fill.empty() ? 1e-4f : 1e-6f;
}

int slot_of(HullDrawing& drawing, std::size_t view) {
  int& slot = drawing.slot_of_view[view];
  if (slot < 0) {
    slot = static_cast<int>(drawing.views.size());
    drawing.views.push_back(static_cast<int>(view));
  }
  return slot;
}

namespace {

/// Adds triangles and their views to a drawing, the wide ones at the end.
class TriangleWriter {
 public:
  explicit TriangleWriter(HullDrawing& drawing) : drawing_(drawing) {}

  /// A triangle without views, or with one only.
  void add(const std::uint32_t* corners, HullVertex (&vertex)[3]) {
    drawing_.vertices.insert(drawing_.vertices.end(), vertex, vertex + 3);
    drawing_.corner.insert(drawing_.corner.end(), corners, corners + 3);
  }
  /// A triangle of which each of \p views may be the best.
  void add(const std::uint32_t* corners, HullVertex (&vertex)[3], const ViewWeights& weights,
           std::vector<std::pair<float, std::size_t>>& views) {
    if (views.size() > narrow && drawing_.lists.size() + views.size() < most_entries)
      return add_wide(corners, vertex, weights, views);
    if (views.size() > narrow) keep_heaviest(views);
    for (std::size_t i = 0; i < narrow && !views.empty(); ++i) {
      const std::size_t view = views[i < views.size() ? i : 0].second;
      const auto at = static_cast<std::uint8_t>(slot_of(drawing_, view));
      for (int j = 0; j < 3; ++j) {
        vertex[j].slots[i] = at;
        if (i < views.size()) vertex[j].weights[i] = fixed(weights(corners[j], view));
      }
    }
    add(corners, vertex);
  }
  /// The number of the first vertex of a wide triangle.
  std::size_t finish() {
    const std::size_t first = drawing_.vertices.size();
    drawing_.vertices.insert(drawing_.vertices.end(), wide_.begin(), wide_.end());
    drawing_.corner.insert(drawing_.corner.end(), wide_corner_.begin(), wide_corner_.end());
    return first;
  }

 private:
  static constexpr std::size_t narrow = 4;  // views that a triangle's vertices hold
  /// Of all lists: OpenGL has them in a texture of 1024 columns, and 2048 rows everywhere. Beyond it
  /// triangles keep the views that weigh most.
  static constexpr std::size_t most_entries = 1024 * 2048;

  static void keep_heaviest(std::vector<std::pair<float, std::size_t>>& views) {
    std::sort(views.begin(), views.end(), [](const auto& x, const auto& y) {
      return x.first > y.first || (x.first == y.first && x.second < y.second);
    });
    views.resize(narrow);
    std::sort(views.begin(), views.end(),
              [](const auto& x, const auto& y) { return x.second < y.second; });
  }

  void add_wide(const std::uint32_t* corners, HullVertex (&vertex)[3], const ViewWeights& weights,
                const std::vector<std::pair<float, std::size_t>>& views) {
    const std::size_t list = drawing_.lists.size();
    drawing_.lists.push_back({static_cast<std::uint16_t>(views.size()), 0, 0, 0});
    for (const auto& [top, view] : views)
      drawing_.lists.push_back({fixed(weights(corners[0], view)), fixed(weights(corners[1], view)),
                                fixed(weights(corners[2], view)),
                                static_cast<std::uint16_t>(slot_of(drawing_, view))});
    for (std::size_t j = 0; j < 3; ++j) {
      vertex[j].weights[j] = 65535;
      for (std::size_t byte = 0; byte < 4; ++byte)
        vertex[j].slots[byte] = static_cast<std::uint8_t>(list >> (8 * byte));
    }
    wide_.insert(wide_.end(), vertex, vertex + 3);
    wide_corner_.insert(wide_corner_.end(), corners, corners + 3);
  }

  HullDrawing& drawing_;
  std::vector<HullVertex> wide_;
  std::vector<std::uint32_t> wide_corner_;
};

/// The views of a triangle that weigh anything on it and that it faces, or, where there is none, of
/// those that it does not: a sliver that leans away from every camera takes the colours of the
/// surface around it, whose weights its vertices share. In their order, so that triangles with the same
/// views name them alike.
void find_views(const std::uint32_t* corner, const Vec3f& a, const Vec3f& cross,
                const std::vector<Vec3f>& centres, const ViewWeights& weights,
                std::vector<std::pair<float, std::size_t>>& found) {
  constexpr float least = 0.5f / 65535.0f;  // less is no weight in a HullVertex
  found.clear();
  bool any_faces = false;
  for (std::size_t k = 0; k < centres.size(); ++k) {
    const float top =
        std::max(std::max(weights(corner[0], k), weights(corner[1], k)), weights(corner[2], k));
    if (!(top >= least)) continue;
    const bool faces = glm::dot(cross, centres[k] - a) > 0.0f;
    if (faces && !any_faces) found.clear();
    any_faces = any_faces || faces;
    if (faces == any_faces) found.emplace_back(top, k);
  }
}

/// Whether the mesh has no texturing, or views of which none has a picture, as masks.
bool is_uncoloured(const Mesh& mesh) {
  return !mesh.texturing || (!mesh.views.empty() &&
                             std::none_of(mesh.views.begin(), mesh.views.end(),
                                          [](const MeshView& v) { return can_colour(v.view); }));
}

void shade(HullVertex& vertex, const Vec3f& normal, const Vec3f& to_eye) {
  const float share = shaded_share(normal, to_eye);
  for (std::uint16_t& level : vertex.fill)
    level = fixed(share * static_cast<float>(level) / 65535.0f);
}

}  // namespace

float shaded_share(const Vec3f& normal, const Vec3f& to_eye) {
  constexpr float even = 0.25f;
  const float lengths = glm::length(normal) * glm::length(to_eye);
  const float facing = lengths > 0.0f ? std::max(glm::dot(normal, to_eye) / lengths, 0.0f) : 0.0f;
  return even + (1.0f - even) * facing;
}

std::size_t add_hull_vertices(const Mesh& mesh, const MeshEye& eye, HullDrawing& drawing) {
  const Hull& hull = mesh.hull;
  const std::size_t views = mesh.views.size();
  drawing.slot_of_view.resize(views, -1);
  const bool textured = usable(mesh), uncoloured = is_uncoloured(mesh);
  const VertexFill fill(mesh);
  const bool direct = textured && mesh.texturing->method == TextureMethod::direct;
  const ViewWeights weights = textured && !direct ? ViewWeights(mesh, eye) : ViewWeights();
  const Vec3f from(eye.place - hull.origin);
  std::vector<Vec3f> centres;
  for (const MeshView& view : mesh.views)
    centres.emplace_back(view.calibration.centre() - hull.origin);

  drawing.vertices.reserve(drawing.vertices.size() + hull.triangles.size() / 2 + 64);
  std::vector<std::pair<float, std::size_t>> found;
  TriangleWriter writer(drawing);
  for (std::size_t f = 0; f + 2 < hull.triangles.size(); f += 3) {
    const std::uint32_t* corner = &hull.triangles[f];
    const Vec3f& a = hull.vertices[corner[0]];
    const Vec3f& b = hull.vertices[corner[1]];
    const Vec3f& c = hull.vertices[corner[2]];
    const Vec3f cross = glm::cross(b - a, c - a);
    // Left to the rasteriser where rounding could decide.
    const float facing = glm::dot(cross, from - a);
    if (facing < -1e-4f * glm::length(cross) * glm::length(from - a)) continue;

    HullVertex vertex[3];
    for (int i = 0; i < 3; ++i) {
      vertex[i].position = hull.vertices[corner[i]];
      vertex[i].fill = fill(corner[i]);
      if (uncoloured)
        shade(vertex[i], hull.normals.empty() ? cross : hull.normals[corner[i]],
              from - vertex[i].position);
    }
    if (textured && !direct) {
      find_views(corner, a, cross, centres, weights, found);
      writer.add(corner, vertex, weights, found);
      continue;
    }
    const int best = direct ? mesh.texturing->best[f / 3] : -1;
    if (best >= 0 && best < static_cast<int>(views) &&
        can_colour(mesh.views[static_cast<std::size_t>(best)].view)) {
      const auto at = static_cast<std::uint8_t>(slot_of(drawing, static_cast<std::size_t>(best)));
      for (HullVertex& v : vertex) {
        v.slots.fill(at);
        v.weights[0] = 65535;
      }
    }
    writer.add(corner, vertex);
  }
  return writer.finish();
}

}  // namespace polyhull
