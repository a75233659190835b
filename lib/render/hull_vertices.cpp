// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/hull_vertices.h"

#include <algorithm>
#include <cmath>

#include "base/srgb.h"

namespace polyhull {
namespace {

constexpr std::size_t most = 4;  // candidates per triangle

std::uint16_t fixed(float weight) {
  return static_cast<std::uint16_t>(std::lround(65535.0f * std::clamp(weight, 0.0f, 1.0f)));
}

/// Per vertex and view the weight that the shader starts from.
class Weights {
 public:
  Weights(const Mesh& mesh, const Vec3& eye) : views_(mesh.views.size()) {
    const Texturing& texturing = *mesh.texturing;
    const std::size_t vertices = mesh.hull.vertices.size();
    weights_.assign(vertices * views_, 0.0f);
    for (std::size_t k = 0; k < views_; ++k) {
      if (!can_colour(mesh.views[k].view)) continue;
      const Vec3f centre(mesh.views[k].calibration.centre() - mesh.hull.origin);
      const Vec3f from(eye - mesh.hull.origin);
      for (std::size_t v = 0; v < vertices; ++v) {
        float weight = texturing.weights[v * views_ + k];
        if (weight > 0.0f && texturing.metric == TextureMetric::viewing_angle) {
          const Vec3f& p = mesh.hull.vertices[v];
          const float cosine = glm::dot(glm::normalize(centre - p), glm::normalize(from - p));
          // Never 0 for a view that sees the point: it may be the only one.
          const float near = 0.5f + 0.5f * cosine;
          weight *= std::max(near * near * near * near, 1e-3f);
        } else {
          weight *= weight;  // the better view prevails, with less of a ghost from the other
        }
        weights_[v * views_ + k] = weight;
      }
    }
  }
  float operator()(std::size_t vertex, std::size_t view) const {
    return weights_[vertex * views_ + view];
  }

 private:
  std::size_t views_;
  std::vector<float> weights_;
};

bool usable(const Mesh& mesh) {
  if (!mesh.texturing || mesh.views.empty() || mesh.views.size() > 64) return false;
  const Texturing& texturing = *mesh.texturing;
  const std::size_t triangles = mesh.hull.triangles.size() / 3;
  return texturing.best.size() == triangles &&
         texturing.weights.size() == mesh.hull.vertices.size() * mesh.views.size();
}

}  // namespace

bool can_colour(const View& view) {
  return view.format == PixelFormat::rgba && !view.roi.empty() && !view.pixels.empty();
}

VertexFill::VertexFill(const Mesh& mesh) {
  const Texturing* texturing = mesh.texturing ? &*mesh.texturing : nullptr;
  if (texturing && !texturing->fill.empty() &&
      texturing->fill.size() == mesh.hull.vertices.size())
    colours_ = &texturing->fill;
  const Vec3f untextured = srgb_decoded(texturing ? texturing->untextured : Vec3f(0.5f));
  plain_ = {fixed(untextured.x), fixed(untextured.y), fixed(untextured.z), 0};
}

std::array<std::uint16_t, 4> VertexFill::operator()(std::uint32_t vertex) const {
  if (!colours_) return plain_;
  const std::uint32_t rgba = (*colours_)[vertex];
  const auto linear = [rgba](int channel) {
    return fixed(srgb_to_linear(static_cast<std::uint8_t>(rgba >> (8 * channel))));
  };
  return {linear(0), linear(1), linear(2), 0};
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

void add_hull_vertices(const Mesh& mesh, const Vec3& eye, HullDrawing& drawing) {
  const Hull& hull = mesh.hull;
  const std::size_t views = mesh.views.size();
  drawing.slot_of_view.resize(views, -1);
  const bool textured = usable(mesh);
  const VertexFill fill(mesh);
  const bool direct = textured && mesh.texturing->method == TextureMethod::direct;
  Mesh none;  // gives the weights nothing to do
  const Weights weights = textured && !direct ? Weights(mesh, eye) : [&] {
    none.texturing.emplace();
    return Weights(none, eye);
  }();
  const Vec3f from(eye - hull.origin);
  std::vector<Vec3f> centres;
  for (const MeshView& view : mesh.views)
    centres.emplace_back(view.calibration.centre() - hull.origin);

  drawing.vertices.reserve(drawing.vertices.size() + hull.triangles.size() / 2 + 64);
  std::vector<std::pair<float, std::size_t>> ranked;
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
    }
    if (direct) {
      const int best = mesh.texturing->best[f / 3];
      if (best >= 0 && best < static_cast<int>(views)) {
        if (can_colour(mesh.views[static_cast<std::size_t>(best)].view)) {
          const auto at =
              static_cast<std::uint8_t>(slot_of(drawing, static_cast<std::size_t>(best)));
          for (HullVertex& v : vertex) {
            v.slots.fill(at);
            v.weights[0] = 65535;
          }
        }
      }
    } else if (textured) {
      // A sliver that leans away from every camera takes the colours of the surface around it,
      // whose weights its vertices share.
      for (const bool facing_only : {true, false}) {
        ranked.clear();
        for (std::size_t k = 0; k < views; ++k) {
          const float top =
              std::max({weights(corner[0], k), weights(corner[1], k), weights(corner[2], k)});
          if (top > 0.0f && (!facing_only || glm::dot(cross, centres[k] - a) > 0.0f))
            ranked.emplace_back(top, k);
        }
        if (!ranked.empty()) break;
      }
      const std::size_t kept = std::min(ranked.size(), most);
      std::partial_sort(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(kept),
                        ranked.end(), [](const auto& x, const auto& y) {
                          return x.first > y.first || (x.first == y.first && x.second < y.second);
                        });
      for (std::size_t i = 0; i < most; ++i) {
        if (i < kept) {
          const std::size_t view = ranked[i].second;
          const auto at = static_cast<std::uint8_t>(slot_of(drawing, view));
          for (int j = 0; j < 3; ++j) {
            vertex[j].slots[i] = at;
            vertex[j].weights[i] = fixed(weights(corner[j], view));
          }
        } else if (kept > 0) {
          for (HullVertex& v : vertex) v.slots[i] = v.slots[0];
        }
      }
    }
    drawing.vertices.insert(drawing.vertices.end(), vertex, vertex + 3);
    drawing.corner.insert(drawing.corner.end(), corner, corner + 3);
  }
}

}  // namespace polyhull
