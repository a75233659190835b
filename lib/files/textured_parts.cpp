// SPDX-License-Identifier: LGPL-2.1-or-later
#include "files/textured_parts.h"

#include <algorithm>
#include <array>
#include <optional>
#include <unordered_map>

#include "base/edge_key.h"
#include "base/srgb.h"
#include "rig/lens.h"

namespace polyhull {
namespace {

struct Triangle {
  std::array<std::uint32_t, 3> corners;
  int view;
};

constexpr int most_rounds = 7;
constexpr std::size_t most_triangles = 4'000'000;

class Splitter {
 public:
  explicit Splitter(const Mesh& mesh) : mesh_(mesh), normals_(mesh.hull.normals) {
    for (const MeshView& view : mesh.views) lenses_.emplace_back(view.calibration);
    for (const Vec3f& vertex : mesh.hull.vertices) vertices_.emplace_back(vertex);
    for (std::size_t i = 0; i < mesh.hull.triangles.size() / 3; ++i) {
      Triangle triangle{{mesh.hull.triangles[3 * i], mesh.hull.triangles[3 * i + 1],
                         mesh.hull.triangles[3 * i + 2]},
                        best_view(i)};
      for (const std::uint32_t corner : triangle.corners)
        if (triangle.view >= 0 && !pixel(triangle.view, vertices_[corner])) triangle.view = -1;
      triangles_.push_back(triangle);
    }
  }

  void split(double max_error) {
    for (int round = 0; round < most_rounds && triangles_.size() < most_triangles; ++round) {
      split_edges_.clear();
      for (const Triangle& triangle : triangles_)
        for (int i = 0; i < 3; ++i)
          if (strays(triangle, i, max_error)) add_middle(triangle, i);
      if (split_edges_.empty()) return;
      std::vector<Triangle> finer;
      finer.reserve(triangles_.size() * 2);
      for (const Triangle& triangle : triangles_) divide(triangle, finer);
      triangles_ = std::move(finer);
    }
  }

  std::vector<TexturedPart> parts() const {
    std::vector<TexturedPart> result;
    for (int view = 0; view <= static_cast<int>(mesh_.views.size()); ++view) {
      TexturedPart part = part_of(view == static_cast<int>(mesh_.views.size()) ? -1 : view);
      if (!part.triangles.empty()) result.push_back(std::move(part));
    }
    return result;
  }

 private:
  int best_view(std::size_t triangle) const {
    const Texturing& texturing = *mesh_.texturing;
    const std::size_t views = mesh_.views.size();
    const auto usable = [&](std::size_t view) {
      return mesh_.views[view].view.format == PixelFormat::rgba;
    };
    if (texturing.best[triangle] >= 0)
      return usable(texturing.best[triangle]) ? texturing.best[triangle] : -1;
    int best = -1;
    float best_weight = 0.0f;
    for (std::size_t view = 0; view < views; ++view) {
      if (!(texturing.visible[triangle] >> view & 1) || !usable(view)) continue;
      float weight = 0.0f;
      for (int corner = 0; corner < 3; ++corner)
        weight += texturing.weights[mesh_.hull.triangles[3 * triangle + corner] * views + view];
      if (weight > best_weight) {
        best_weight = weight;
        best = static_cast<int>(view);
      }
    }
    return best;
  }

  std::optional<Vec2> pixel(int view, const Vec3& vertex) const {
    const auto ideal = mesh_.views[view].calibration.project_ideal(mesh_.hull.origin + vertex);
    if (!ideal) return std::nullopt;
    return lenses_[view].distort(*ideal);
  }

  bool strays(const Triangle& triangle, int edge, double max_error) const {
    if (triangle.view < 0) return false;
    const Vec3& a = vertices_[triangle.corners[edge]];
    const Vec3& b = vertices_[triangle.corners[(edge + 1) % 3]];
    const auto p = pixel(triangle.view, a);
    const auto q = pixel(triangle.view, b);
    const auto middle = pixel(triangle.view, 0.5 * (a + b));
    return p && q && middle && glm::length(*middle - 0.5 * (*p + *q)) > max_error;
  }

  void add_middle(const Triangle& triangle, int edge) {
    const std::uint32_t a = triangle.corners[edge], b = triangle.corners[(edge + 1) % 3];
    const auto [place, added] =
        split_edges_.try_emplace(edge_key(a, b), static_cast<std::uint32_t>(vertices_.size()));
    if (!added) return;
    vertices_.push_back(0.5 * (vertices_[a] + vertices_[b]));
    if (normals_.empty()) return;
    const Vec3f normal = normals_[a] + normals_[b];
    const float length = glm::length(normal);
    normals_.push_back(length > 0.0f ? normal / length : normals_[a]);
  }

  // Middles of the edges that are split, by this triangle or its neighbours; all sides agree.
  void divide(const Triangle& triangle, std::vector<Triangle>& out) const {
    constexpr std::uint32_t none = ~0u;
    std::array<std::uint32_t, 3> middle;
    int count = 0;
    for (int i = 0; i < 3; ++i) {
      const auto found =
          split_edges_.find(edge_key(triangle.corners[i], triangle.corners[(i + 1) % 3]));
      middle[i] = found == split_edges_.end() ? none : found->second;
      count += middle[i] != none;
    }
    const int view = triangle.view;
    const auto& c = triangle.corners;
    if (count == 0) {
      out.push_back(triangle);
    } else if (count == 3) {
      for (int i = 0; i < 3; ++i) out.push_back({{c[i], middle[i], middle[(i + 2) % 3]}, view});
      out.push_back({middle, view});
    } else {
      // Turned so that edge 0 is split and, of two, edge 1 as well.
      int first = 0;
      while (middle[first] == none || (count == 2 && middle[(first + 1) % 3] == none)) ++first;
      const std::uint32_t a = c[first], b = c[(first + 1) % 3], d = c[(first + 2) % 3];
      const std::uint32_t m = middle[first], n = middle[(first + 1) % 3];
      out.push_back({{a, m, d}, view});
      if (count == 1) {
        out.push_back({{m, b, d}, view});
      } else {
        out.push_back({{m, b, n}, view});
        out.push_back({{m, n, d}, view});
      }
    }
  }

  TexturedPart part_of(int view) const {
    TexturedPart part;
    part.view = view;
    std::unordered_map<std::uint32_t, std::uint32_t> index;
    for (const Triangle& triangle : triangles_) {
      if (triangle.view != view) continue;
      for (const std::uint32_t corner : triangle.corners) {
        const auto [place, added] =
            index.try_emplace(corner, static_cast<std::uint32_t>(part.positions.size()));
        if (added) {
          part.positions.emplace_back(vertices_[corner]);
          if (!normals_.empty()) part.normals.push_back(normals_[corner]);
          if (view >= 0) part.coordinates.push_back(coordinate(view, vertices_[corner]));
        }
        part.triangles.push_back(place->second);
      }
    }
    return part;
  }

  Vec2f coordinate(int view, const Vec3& vertex) const {
    const Rectangle& roi = mesh_.views[view].view.roi;
    const Vec2 p = pixel(view, vertex).value_or(Vec2(roi.x, roi.y));
    return {static_cast<float>((p.x - roi.x + 0.5) / roi.width),
            static_cast<float>((p.y - roi.y + 0.5) / roi.height)};
  }

  const Mesh& mesh_;
  std::vector<Lens> lenses_;
  std::vector<Vec3> vertices_;
  std::vector<Vec3f> normals_;  // of the vertices, or none
  std::vector<Triangle> triangles_;
  std::unordered_map<std::uint64_t, std::uint32_t> split_edges_;
};

}  // namespace

std::vector<TexturedPart> textured_parts(const Mesh& mesh, double max_error) {
  Splitter splitter(mesh);
  splitter.split(max_error);
  return splitter.parts();
}

Picture texture_picture(const Mesh& mesh, std::size_t number) {
  const View& view = mesh.views[number].view;
  const Mat3f colour = colour_of(*mesh.texturing, mesh.views[number].calibration, number);
  constexpr int spread = 4;
  constexpr std::uint8_t foreground = 128;
  const int width = view.roi.width, height = view.roi.height;
  Picture picture{width, height, 3, std::vector<std::uint8_t>(std::size_t(width) * height * 3)};
  std::vector<std::uint8_t> known(std::size_t(width) * height);
  const bool coloured = colour != Mat3f(1.0f);
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* source = view.pixels.data() + std::size_t(y) * view.stride;
    for (int x = 0; x < width; ++x) {
      std::uint8_t* const target = picture.row(y) + 3 * x;
      std::copy_n(source + 4 * x, 3, target);
      if (coloured) {
        const Vec3f light = colour * Vec3f(srgb_to_linear(target[0]), srgb_to_linear(target[1]),
                                           srgb_to_linear(target[2]));
        for (int c = 0; c < 3; ++c) target[c] = linear_to_srgb(light[c]);
      }
      known[std::size_t(y) * width + x] = source[4 * x + 3] >= foreground;
    }
  }
  for (int round = 0; round < spread; ++round) {
    const std::vector<std::uint8_t> before = known;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        if (before[std::size_t(y) * width + x]) continue;
        int sum[3] = {}, count = 0;
        for (int v = std::max(y - 1, 0); v <= std::min(y + 1, height - 1); ++v)
          for (int u = std::max(x - 1, 0); u <= std::min(x + 1, width - 1); ++u)
            if (before[std::size_t(v) * width + u]) {
              for (int c = 0; c < 3; ++c) sum[c] += picture.row(v)[3 * u + c];
              ++count;
            }
        if (count == 0) continue;
        for (int c = 0; c < 3; ++c)
          picture.row(y)[3 * x + c] = static_cast<std::uint8_t>((sum[c] + count / 2) / count);
        known[std::size_t(y) * width + x] = 1;
      }
    }
  }
  return picture;
}

}  // namespace polyhull
