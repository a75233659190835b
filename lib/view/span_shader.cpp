// SPDX-License-Identifier: LGPL-2.1-or-later
#include "view/span_shader.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "raytrace/loops/view_loops.h"

namespace polyhull {

/// The shares of a triangle's corners along a row.
struct SpanShader::Shares {
  RowCourse all, second, third;

  Shares(const ScreenTriangle& piece, const Span& span) {
    const auto course = [&](const ScreenPlane& plane) {
      return RowCourse{static_cast<float>(plane.value + span.x * plane.dx + span.y * plane.dy),
                       static_cast<float>(plane.dx), static_cast<float>(plane.dy)};
    };
    all = course(piece.inverse);
    second = course(piece.second);
    third = course(piece.third);
  }

  /// Of a value that the corners have.
  RowCourse of(float a, float b, float c) const {
    b -= a;
    c -= a;
    return {a * all.start + b * second.start + c * third.start,
            a * all.dx + b * second.dx + c * third.dx, a * all.dy + b * second.dy + c * third.dy};
  }
};

SpanShader::SpanShader(const TracedScene& scene, const LightCache& light)
    : scene_(scene), light_(light) {
  for (std::uint32_t m = 0; m < scene.scene().meshes.size(); ++m) add_faces(m);
}

void SpanShader::add_faces(std::uint32_t m) {
  const Scene& scene = scene_.scene();
  const SceneMesh& mesh = scene.meshes[m];
  const bool is_mirror = scene.materials[mesh.material].is_mirror();
  const std::vector<int> mirrors = mirrors_of_triangles(scene, m);
  for (std::uint32_t i = 0; i < mesh.triangles.size() / 3; ++i) {
    const std::uint32_t* corner = &mesh.triangles[3 * static_cast<std::size_t>(i)];
    const int mirror = mirrors[i] >= 0 ? mirrors[i] : is_mirror ? not_planar : no_mirror;
    Face face{m, i, mirror, light_.grid().face(m, i), {}};
    if (!mesh.texture_coordinates.empty())
      for (int k = 0; k < 3; ++k) face.texture[k] = mesh.texture_coordinates[corner[k]];
    faces_.push_back(face);
  }
}

void SpanShader::look_from(const Vec3f& eye) {
  const Scene& scene = scene_.scene();
  eye_ = eye;
  looks_.assign(scene.meshes.size(), {});
  for (std::size_t m = 0; m < looks_.size(); ++m) {
    const Material& material = scene.materials[scene.meshes[m].material];
    looks_[m].albedo = to_float4(material.base_colour * light_.gain() *
                                 (scene.exposure / std::numbers::pi_v<float>));
    looks_[m].emitted = to_float4(glm::min(scene.exposure * material.emission, Vec3f(1.0f)));
    looks_[m].texture = scene_.texture(static_cast<std::uint32_t>(m));
    looks_[m].double_sided = material.double_sided;
  }
  for (const Light& light : scene.lights) {
    // A light shines from its front only.
    if (light.mesh >= 0 && glm::dot(glm::cross(light.u, light.v), light.centre - eye) > 0.0f)
      looks_[light.mesh].emitted = Float4{};
  }
}

bool SpanShader::seen_from_behind(const Face& face) const {
  const SceneMesh& mesh = scene_.scene().meshes[face.mesh];
  const std::uint32_t* corner = &mesh.triangles[3 * static_cast<std::size_t>(face.triangle)];
  const Vec3f p0 = mesh.positions[corner[0]];
  const Vec3f normal = glm::cross(mesh.positions[corner[1]] - p0, mesh.positions[corner[2]] - p0);
  return glm::dot(normal, p0 - eye_) > 0.0f;
}

/// The irradiance at \p places whose depths are given.
void SpanShader::light(const Face& face, const Shares& shares, const PlaceRow& places,
                       const float* depth, Float4* values) const {
  const bool back = looks_[face.mesh].double_sided && seen_from_behind(face);
  const Float4* nodes = light_.values(face.mesh, back) + face.light.first;
  const SurfaceGrid::Face& on = face.light;
  if (on.columns == 0) {
    const Float4 a = nodes[on.corner[0]];
    const Float4 b = nodes[on.corner[1]] - a, c = nodes[on.corner[2]] - a;
    const Float4 start = a * shares.all.start + b * shares.second.start + c * shares.third.start;
    const Float4 dx = a * shares.all.dx + b * shares.second.dx + c * shares.third.dx;
    const Float4 dy = a * shares.all.dy + b * shares.second.dy + c * shares.third.dy;
    for (int i = 0; i < places.count; ++i) {
      const float x = static_cast<float>(i) + places.right[i];
      values[i] = (start + x * dx + places.down[i] * dy) * depth[i];
    }
    return;
  }
  const RowCourse across = shares.of(on.at[0].x, on.at[1].x, on.at[2].x);
  const RowCourse down = shares.of(on.at[0].y, on.at[1].y, on.at[2].y);
  ViewLoops::best().light(
      {depth, across, down, nodes, light_.borders(face.mesh, back), static_cast<int>(on.stride),
       static_cast<int>(on.columns), static_cast<int>(on.rows), on.fan},
      places, values);
}

const SpanShader::Look& SpanShader::shade(const ScreenTriangle& piece, const Span& span,
                                          Float4* values) const {
  const Face& face = faces_[piece.id];
  const Look& look = looks_[face.mesh];
  const Shares shares(piece, span);
  const PlaceRow places{span.count, span.right, span.down};
  float depth[Span::most];
  ViewLoops::best().depths(shares.all, places, depth);
  light(face, shares, places, depth, values);
  if (look.texture != nullptr) {
    const Vec2f* at = face.texture;
    ViewLoops::best().texture(look.texture->levels(),
                              {span.count, depth, shares.all, shares.of(at[0].x, at[1].x, at[2].x),
                               shares.of(at[0].y, at[1].y, at[2].y)},
                              places, values);
  }
  return look;
}

}  // namespace polyhull
