// SPDX-License-Identifier: LGPL-2.1-or-later
// What the processor's renderer says that surfaces scatter, against rays through pixels' middles.
#include "render/processor/scene/albedo_layer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/memory/sparse_array.h"
#include "render/processor/scene/receivers.h"
#include "synthetic.h"

namespace polyhull::processor {
namespace {

/// A smooth ball: normals of its own at every vertex.
SceneMesh ball(const Vec3f& centre, float radius, int material) {
  constexpr std::uint32_t rings = 12, around = 24;
  SceneMesh mesh;
  mesh.material = material;
  for (std::uint32_t i = 0; i <= rings; ++i) {
    for (std::uint32_t j = 0; j <= around; ++j) {
      const float a = 3.14159265f * static_cast<float>(i) / rings;
      const float b = 6.2831853f * static_cast<float>(j) / around;
      const Vec3f n(std::sin(a) * std::cos(b), std::cos(a), std::sin(a) * std::sin(b));
      mesh.positions.push_back(centre + radius * n);
      mesh.normals.push_back(n);
      if (i == rings || j == around) continue;
      const std::uint32_t at = i * (around + 1) + j, below = at + around + 1;
      mesh.triangles.insert(mesh.triangles.end(), {at, at + 1, below, below, at + 1, below + 1});
    }
  }
  return mesh;
}

/// A room with a glossy ball, and a texture as smooth as levels of it make no difference on the walls.
class AlbedoLayerTest : public ::testing::Test {
 protected:
  static constexpr int width = 331, height = 190;  // no multiples of sixteen
  AlbedoLayerTest() {
    Scene scene = synthetic::small_room(true);
    Material gloss;
    gloss.roughness = 0.0f;
    gloss.base_colour = {0.7f, 0.4f, 0.2f};
    scene.materials.push_back(gloss);
    scene.meshes.push_back(
        ball({0.3f, 0.9f, 0.4f}, 0.5f, static_cast<int>(scene.materials.size()) - 1));
    Picture picture{256, 256, 4, std::vector<std::uint8_t>(256 * 256 * 4, 255)};
    for (int i = 0; i < 256 * 256; ++i) {
      const double x = i % 256 / 256.0 * 6.2831853, y = i / 256 / 256.0 * 6.2831853;
      picture.pixels[4 * i] = static_cast<std::uint8_t>(150 + 80 * std::sin(x));
      picture.pixels[4 * i + 1] = static_cast<std::uint8_t>(150 + 80 * std::cos(y));
    }
    scene.textures.push_back(picture);
    for (SceneMesh& mesh : scene.meshes) {
      Material& material = scene.materials[static_cast<std::size_t>(mesh.material)];
      if (material.emission != Vec3f(0.0f) || material.is_mirror()) continue;
      material.base_colour_texture = static_cast<int>(scene.textures.size()) - 1;
      mesh.texture_coordinates.clear();
      for (const Vec3f& p : mesh.positions)
        mesh.texture_coordinates.emplace_back(p.x + 0.3f * p.y, p.z);
    }
    traced = std::make_unique<TracedScene>(std::move(scene));
    camera = synthetic::look_at({1.3, 1.5, 3.2}, {0.0, 0.7, 0.0}, width, height, 60.0);
    layer.set(traced.get(), {pixels_from_scene(camera), width, height, 4, {}, false});
    layer.ensure_middles({0, 0, width, height});
  }
  Ray ray(int x, int y) const {
    Ray out;
    out.origin = Vec3f(camera.centre());
    out.direction = Vec3f(camera.ray({static_cast<double>(x), static_cast<double>(y)}));
    return out;
  }
  /// Whether all that the eight pixels around show is of the mesh of \p hit.
  bool inside(const RayHit& hit, int x, int y) const {
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i)
        if (traced->caster().intersect(ray(x + i, y + j)).mesh != hit.mesh) return false;
    return true;
  }

  std::unique_ptr<TracedScene> traced;
  Camera camera;
  SceneLayer layer;
};

TEST(SparseArray, KeepsWhereThereIsRoomAndElseIsZero) {
  constexpr std::size_t small = 1000, large = 100'000;
  SparseArray<int> values;
  values.make_room(0);
  EXPECT_EQ(values.data(), nullptr);
  values.make_room(small);
  values[small - 1] = 7;
  for (const std::size_t size : {small, small / 2, std::size_t{0}}) {
    values.make_room(size);
    EXPECT_EQ(values[small - 1], 7) << size;
  }
  values.make_room(large);
  EXPECT_EQ(std::count(values.data(), values.data() + large, 0), std::ptrdiff_t{large});
}

TEST_F(AlbedoLayerTest, IsWhatRaysFind) {
  AlbedoLayer albedo;
  albedo.reset({0, 0, camera.width, camera.height}, Vec3f(camera.centre()), PixelRays(camera));
  int mirrors = 0, others = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::uint64_t packed = albedo.at(*traced, layer, x & ~15, y)[x & 15];
      const RayHit hit = traced->caster().intersect(ray(x, y));
      if (!hit.hit() || !inside(hit, x, y)) continue;
      const Surface surface = traced->surface(ray(x, y), hit);
      Vec3f expected = traced->base_colour(hit);
      if (surface.material->is_mirror()) {
        const float cosine = -glm::dot(surface.normal, glm::normalize(ray(x, y).direction));
        expected *= (Vec3f(1.0f) - fresnel(surface.material->f0(), std::abs(cosine))) *
                    (1.0f - surface.material->metallic);
      }
      ++(surface.material->is_mirror() ? mirrors : others);
      for (int k = 0; k < 3; ++k)
        ASSERT_NEAR(static_cast<float>(packed >> (16 * k) & 0xffff) / 65535.0f, expected[k], 0.02f)
            << x << ", " << y << ", mesh " << hit.mesh;
      ASSERT_EQ(packed >> 48, 0u);
    }
  }
  EXPECT_GT(mirrors, 1000);
  EXPECT_GT(others, 10000);
}

TEST_F(AlbedoLayerTest, ReceiversAreWhatRaysFind) {
  ReceiverFinder receivers(*traced, layer, Vec3f(camera.centre()));
  int found = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const RayHit hit = traced->caster().intersect(ray(x, y));
      if (!hit.hit() || !inside(hit, x, y)) continue;
      const Surface surface = traced->surface(ray(x, y), hit);
      const Receiver receiver = receivers.at(x, y, ray(x, y).direction);
      ASSERT_LT(glm::length(receiver.normal - surface.normal), 1e-3f) << x << ", " << y;
      ASSERT_LT(
          glm::length(receiver.point - (surface.lifted + traced->epsilon() * surface.geometric)),
          2e-5f)
          << x << ", " << y;
      ++found;
    }
  }
  EXPECT_GT(found, 20000);
}

}  // namespace
}  // namespace polyhull::processor
