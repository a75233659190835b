// SPDX-License-Identifier: LGPL-2.1-or-later
#include "view/scene_on_screen.h"

#include <algorithm>
#include <limits>

#include "base/thread_pool.h"

namespace polyhull {
namespace {

/// How near to the eye triangles are drawn, metres: of scenes below a metre in proportion to their size.
double near_of(const Scene& scene) {
  Vec3f low(std::numeric_limits<float>::infinity()), high = -low;
  for (const SceneMesh& mesh : scene.meshes)
    for (const Vec3f& position : mesh.positions) {
      low = glm::min(low, position);
      high = glm::max(high, position);
      const Vec3f size = high - low;
      if (glm::dot(size, size) >= 1.0f) return near_depth;
    }
  return near_depth * std::max(glm::length(Vec3(high) - Vec3(low)), 1e-6);
}

}  // namespace

Mat4 pixels_from_scene(const Camera& camera) {
  Mat4 scene(camera.R);
  scene[3] = Vec4(camera.t, 1.0);
  Mat3 shifted = camera.K;  // here a pixel's middle is half a pixel inside
  shifted[2] += Vec3(0.5, 0.5, 0.0);
  return Mat4(shifted) * scene;
}

void SceneOnScreen::set(const Scene& scene, const Mat4& pixels_from_scene,
                        const std::optional<Vec4>& kept, int width, int height, int threads) {
  std::vector<std::size_t> first{0};  // of each mesh's triangles, and the end
  for (const SceneMesh& mesh : scene.meshes)
    first.push_back(first.back() + mesh.triangles.size() / 3);
  parts_.resize((first.back() + part_triangles - 1) / part_triangles);
  const double near = near_of(scene);
  const auto corner = [&](const Vec3f& position) {
    const Vec4 point(Vec3(position), 1.0);
    return Corner{Vec3(pixels_from_scene * point), kept ? glm::dot(*kept, point) : 1.0};
  };
  parallel_each(parts_.size(), 1, threads, [&](std::size_t part) {
    ScreenTriangles& triangles = parts_[part];
    triangles.begin(width, height, near);
    std::size_t id = part * part_triangles;
    const std::size_t last = std::min(id + part_triangles, first.back());
    auto mesh = static_cast<std::size_t>(std::upper_bound(first.begin(), first.end(), id) -
                                         first.begin() - 1);
    for (; id < last; ++id) {
      while (id >= first[mesh + 1]) ++mesh;
      const SceneMesh& of = scene.meshes[mesh];
      const std::uint32_t* t = &of.triangles[3 * (id - first[mesh])];
      triangles.add(
          {corner(of.positions[t[0]]), corner(of.positions[t[1]]), corner(of.positions[t[2]])},
          static_cast<std::uint32_t>(id), Facing::both);
    }
  });
}

void SceneOnScreen::draw(int band, const SampleRows& rows) const {
  for (std::size_t part = 0; part < parts_.size(); ++part)
    parts_[part].draw(band, rows, static_cast<std::uint32_t>(part << part_bits));
}

void SceneOnScreen::look(int band, CoveredBlocks& blocks) const {
  const auto each = [&](const auto& give) {
    for (std::size_t part = 0; part < parts_.size(); ++part)
      parts_[part].each(band, static_cast<std::uint32_t>(part << part_bits), give);
  };
  each([&](const ScreenTriangle& t, std::uint32_t number) { blocks.cover(t, number); });
  each([&](const ScreenTriangle& t, std::uint32_t number) { blocks.show(t, number); });
}

void SceneOnScreen::draw(const CoveredBlocks& blocks, int first, int last,
                         const SampleRows& rows) const {
  thread_local std::vector<std::uint32_t> memory;
  std::vector<std::uint32_t>& numbers = memory;
  const std::vector<CoveredBlocks::Shown>& shown = blocks.shown();
  for (auto at = shown.begin(); at != shown.end();) {
    const std::uint32_t part = at->number >> part_bits, base = part << part_bits;
    numbers.clear();
    for (; at != shown.end() && at->number >> part_bits == part; ++at)
      if (at->first <= last && at->last >= first) numbers.push_back(at->number - base);
    parts_[part].draw(numbers, rows, base);
  }
}

}  // namespace polyhull
