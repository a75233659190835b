// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/scene/albedo_layer.h"

#include <algorithm>
#include <cmath>

#include "raytrace/float4.h"
#include "raytrace/loops/view_loops.h"

namespace polyhull::processor {
namespace {

std::uint64_t packed(const Float4& value) {
  const Float4 one{1.0f, 1.0f, 1.0f, 1.0f};
  Float4 held = value > 0.0f ? value : Float4{};
  held = held < 1.0f ? held : one;
  std::uint64_t out = 0;
  for (int k = 0; k < 3; ++k)
    out |= static_cast<std::uint64_t>(static_cast<int>(held[k] * 65535.0f + 0.5f)) << (16 * k);
  return out;
}

/// \p texture, which lies on triangle \p corner of \p mesh, at the middles of \p count pixels from
/// (x, y) on, which show its piece \p at.
void look_up(const FilteredTexture& texture, const SceneMesh& mesh, const std::uint32_t* corner,
             const ScreenTriangle& at, int x, int y, int count, Float4* values) {
  const auto course = [&](const ScreenPlane& plane) {
    return RowCourse{static_cast<float>(plane.value + (x + 0.5) * plane.dx + (y + 0.5) * plane.dy),
                     static_cast<float>(plane.dx), static_cast<float>(plane.dy)};
  };
  const RowCourse all = course(at.inverse), second = course(at.second), third = course(at.third);
  const auto of = [&](int k) {
    const float a = mesh.texture_coordinates[corner[0]][k];
    const float b = mesh.texture_coordinates[corner[1]][k] - a;
    const float c = mesh.texture_coordinates[corner[2]][k] - a;
    return RowCourse{a * all.start + b * second.start + c * third.start,
                     a * all.dx + b * second.dx + c * third.dx,
                     a * all.dy + b * second.dy + c * third.dy};
  };
  float depth[AlbedoLayer::piece];
  for (int i = 0; i < count; ++i)
    depth[i] = 1.0f / std::max(all.start + static_cast<float>(i) * all.dx, 1e-30f);
  ViewLoops::best().texels(texture.levels(), {count, depth, all, of(0), of(1)}, values);
}

}  // namespace

/// Leaves of \p values what a mirror does not reflect, where it is seen from here.
void AlbedoLayer::scatter(const TracedScene& scene, const SceneLayer& layer, int x, int y,
                          int count, Float4* values) const {
  const SceneLayer::Triangle shown = layer.triangle(layer.piece(*layer.middle_piece(x, y)));
  const Material& material = scene.scene().materials[static_cast<std::size_t>(shown.of->material)];
  const Vec3f* normals = shown.of->normals.data();
  Vec3f normal = normals[shown.corner[0]];
  float fifth[piece];
  if (normal == normals[shown.corner[1]] && normal == normals[shown.corner[2]]) {
    const Vec3f way = rays_.at(x, y);
    normal *= (glm::dot(way, normal) > 0.0f ? -1.0f : 1.0f) / glm::length(normal);
    ViewLoops::best().fresnel({count,
                               {way.x, way.y, way.z},
                               {rays_.x.x, rays_.x.y, rays_.x.z},
                               {normal.x, normal.y, normal.z}},
                              fifth);
  } else {
    for (int i = 0; i < count; ++i) {
      Ray ray;
      ray.origin = eye_;
      const Surface surface = scene.plain_surface(ray, layer.hit(x + i, y));
      const float cosine = std::abs(glm::dot(surface.normal, glm::normalize(surface.point - eye_)));
      fifth[i] = fresnel(Vec3f(0.0f), cosine).x;
    }
  }
  const Float4 most = (1.0f - to_float4(material.f0())) * (1.0f - material.metallic);
  for (int i = 0; i < count; ++i) values[i] *= most * (1.0f - fifth[i]);
}

/// Of \p count pixels from (x, y) on, whose middles show the same piece.
void AlbedoLayer::find(const TracedScene& scene, const SceneLayer& layer, int x, int y, int count,
                       std::uint64_t* out) const {
  const std::uint32_t number = *layer.middle_piece(x, y);
  std::fill_n(out, count, std::uint64_t{0});
  if (number == no_triangle) return;
  const ScreenTriangle& at = layer.piece(number);
  const SceneLayer::Triangle shown = layer.triangle(at);
  const Material& material = scene.scene().materials[static_cast<std::size_t>(shown.of->material)];
  const FilteredTexture* texture = scene.texture(shown.mesh);
  Float4 values[piece];
  if (texture != nullptr)
    look_up(*texture, *shown.of, shown.corner, at, x, y, count, values);
  else
    std::fill_n(values, count, Float4{1.0f, 1.0f, 1.0f, 1.0f});
  if (material.is_mirror()) scatter(scene, layer, x, y, count, values);
  const Float4 colour = to_float4(material.base_colour);
  if (texture == nullptr && !material.is_mirror()) {
    std::fill_n(out, count, packed(colour));
    return;
  }
  for (int i = 0; i < count; ++i) out[i] = packed(colour * values[i]);
}

void AlbedoLayer::reset(const Rectangle& part, const Vec3f& eye, const PixelRays& rays) {
  eye_ = eye;
  rays_ = rays;
  left_ = part.x / piece * piece;
  top_ = part.y;
  columns_ = static_cast<std::size_t>((part.x + part.width - left_ + piece - 1) / piece);
  const std::size_t pieces = columns_ * static_cast<std::size_t>(part.height);
  known_.assign(pieces, 0);
  values_.make_room(pieces * piece);
}

const std::uint64_t* AlbedoLayer::at(const TracedScene& scene, const SceneLayer& layer, int x,
                                     int y) {
  const std::size_t place =
      static_cast<std::size_t>(y - top_) * columns_ + static_cast<std::size_t>((x - left_) / piece);
  std::uint64_t* values = &values_[place * piece];
  if (known_[place]) return values;
  known_[place] = 1;
  const int count = std::min(piece, layer.view().width - x);
  const std::uint32_t* numbers = layer.middle_piece(x, y);
  for (int first = 0; first < count;) {
    int end = first + 1;
    while (end < count && numbers[end] == numbers[first]) ++end;
    find(scene, layer, x + first, y, end - first, values + first);
    first = end;
  }
  return values;
}

}  // namespace polyhull::processor
