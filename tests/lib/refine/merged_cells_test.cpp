// SPDX-License-Identifier: LGPL-2.1-or-later
// Cells merged to boxes: closed manifolds without crossings wherever the function comes from, as near to
// it as marching cubes where it bends little, and the same on any number of threads.
#include "refine/merge/merged_cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/mesh_checks.h"
#include "support/scenes.h"

namespace polyhull::refine {
namespace {

/// A level of a function of the node, outside at the border.
template <typename Function>
Level level_of(int nx, int ny, int nz, const Function& f) {
  Level level;
  level.grid = {Vec3f(0.0f), 1.0f, nx, ny, nz};
  level.rows.assign(static_cast<std::size_t>(ny) * nz, {0, nx});
  level.values.resize(level.grid.size());
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x) {
        const bool border = x == 0 || y == 0 || z == 0 || x == nx - 1 || y == ny - 1 || z == nz - 1;
        level.values[level.grid.node(x, y, z)] =
            border ? outside : std::clamp(f(Vec3f(x, y, z)), outside, deepest);
      }
  return level;
}

Hull hull_of(CellSurface& cells) {
  Hull hull;
  hull.vertices = cells.points;
  hull.normals = cells.normals;
  hull.triangles = cells.triangles;
  hull.faces.assign(
      1, {-1, HullFace::no_edge, 0, static_cast<std::uint32_t>(hull.triangles.size() / 3)});
  return hull;
}

Hull merged(const Level& level, int threads = 1, const ContactRays& rays = {},
            float at_rims = 0.07f, float anywhere = 0.2f) {
  CellSurface cells;
  CellMerger().march(level, rays, 0, {.anywhere = anywhere, .at_rims = at_rims}, cells, threads);
  return hull_of(cells);
}

Hull marched(const Level& level) {
  CellSurface cells;
  CellMarcher().march(level, cells, 1);
  return hull_of(cells);
}

/// Waves of random directions, the more the rougher.
Level waves(std::uint64_t seed) {
  test::Dice dice(seed);
  const double roughness = dice.between(0.1, 0.9),
               noise = dice.chance(0.3) ? dice.between(0, 0.6) : 0;
  std::vector<Vec3f> ways;
  std::vector<float> phases;
  for (int i = 0; i < 6; ++i) {
    ways.push_back(static_cast<float>(roughness) *
                   Vec3f(dice.between(-1, 1), dice.between(-1, 1), dice.between(-1, 1)));
    phases.push_back(static_cast<float>(dice.between(0, 6.3)));
  }
  return level_of(seed % 10 == 0 ? 72 : 24, 21, seed % 10 == 0 ? 7 : 23, [&](const Vec3f& p) {
    float sum = static_cast<float>(dice.between(-noise, noise));
    for (std::size_t i = 0; i < ways.size(); ++i) sum += std::sin(glm::dot(ways[i], p) + phases[i]);
    return sum;
  });
}

Level ball(float radius) {
  return level_of(48, 45, 43, [&](const Vec3f& p) {
    return radius - glm::distance(p, Vec3f(23.3f, 21.8f, 20.9f));
  });
}

/// Calls body(bucket) for those of 24 x 8 x 8 buckets, three nodes wide, that a box reaches.
template <typename Body>
void each_bucket(const Vec3f& low, const Vec3f& high, const Body& body) {
  const glm::ivec3 from(low / 3.0f), to(high / 3.0f);
  for (int z = from.z; z <= to.z; ++z)
    for (int y = from.y; y <= to.y; ++y)
      for (int x = from.x; x <= to.x; ++x) body(static_cast<std::size_t>((8 * z + y) * 24 + x));
}

/// Whether an edge pierces a triangle that has none of its ends.
bool crosses_itself(const Hull& hull) {
  const std::vector<std::uint32_t>& t = hull.triangles;
  const auto at = [&](std::size_t corner) { return hull.vertices[t[corner]]; };
  std::vector<std::vector<std::size_t>> buckets(8 * 8 * 24);
  for (std::size_t k = 0; k < t.size(); k += 3)
    each_bucket(glm::min(at(k), glm::min(at(k + 1), at(k + 2))),
                glm::max(at(k), glm::max(at(k + 1), at(k + 2))),
                [&](std::size_t bucket) { buckets[bucket].push_back(k); });
  bool found = false;
  for (std::size_t i = 0; i < t.size(); ++i) {
    const std::size_t next = i % 3 == 2 ? i - 2 : i + 1;
    if (t[i] > t[next]) continue;  // its partner is looked at
    each_bucket(glm::min(at(i), at(next)), glm::max(at(i), at(next)), [&](std::size_t bucket) {
      for (const std::size_t k : buckets[bucket]) {
        bool shared = false;
        for (std::size_t c = k; c < k + 3; ++c) shared |= t[c] == t[i] || t[c] == t[next];
        found |= !shared && test::pierces(Vec3(at(i)), Vec3(at(next)), Vec3(at(k)), Vec3(at(k + 1)),
                                          Vec3(at(k + 2)));
      }
    });
  }
  return found;
}

TEST(MergedCells, WavesAreClosedAndNothingCrosses) {
  std::size_t before = 0, after = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const Level level = waves(seed);
    const Hull hull = merged(level);
    const test::MeshReport report = test::check_mesh(hull);
    ASSERT_TRUE(report.sound()) << seed << ": " << report.describe();
    ASSERT_FALSE(crosses_itself(hull)) << seed;
    before += marched(level).triangles.size() / 3, after += hull.triangles.size() / 3;
  }
  EXPECT_LT(after, before * 8 / 10);  // so boxes of all kinds were made
}

/// Of surface that is far from flat only a box's topology says whether it may be one polygon.
TEST(MergedCells, WhateverLeavesItsPlaneIsClosedAndNothingCrosses) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const Hull hull = merged(waves(seed), 1, {}, 0.07f, 3.0f);
    const test::MeshReport report = test::check_mesh(hull);
    ASSERT_TRUE(report.sound()) << seed << ": " << report.describe();
    ASSERT_FALSE(crosses_itself(hull)) << seed;
  }
}

TEST(MergedCells, ABallKeepsItsShape) {
  const Level level = ball(17.0f);
  const Hull fine = marched(level), hull = merged(level);
  EXPECT_LT(hull.triangles.size() * 4, fine.triangles.size());
  const double volume = 4.0 / 3.0 * 3.14159265 * 17.0 * 17.0 * 17.0;
  EXPECT_NEAR(test::check_mesh(hull).volume, volume, 0.01 * volume);
  double most = 0.0;
  for (std::size_t i = 0; i < hull.vertices.size(); ++i) {
    const Vec3f way = hull.vertices[i] - Vec3f(23.3f, 21.8f, 20.9f);
    most = std::max(most, std::abs(double(glm::length(way)) - 17.0));
    ASSERT_GT(glm::dot(hull.normals[i], way / glm::length(way)), 0.99f);
  }
  EXPECT_LT(most, 0.35);
}

TEST(MergedCells, RimsKeepSmallTriangles) {
  const Level level = ball(17.0f);
  ContactRays rays;
  for (int i = 0; i < 400; ++i) {  // a great circle
    ContactRay ray;
    const float angle = 6.2831853f * static_cast<float>(i) / 400.0f;
    ray.origin = Vec3f(23.3f, 21.8f, 20.9f) + 17.0f * Vec3f(std::cos(angle), std::sin(angle), 0.0f);
    ray.value = 0.0f;
    rays.rays.push_back(ray);
  }
  const auto near_rim = [](const Hull& hull) {
    return std::count_if(hull.vertices.begin(), hull.vertices.end(),
                         [](const Vec3f& p) { return std::abs(p.z - 20.9f) < 1.5f; });
  };
  EXPECT_GT(near_rim(merged(level, 1, rays, 0.02f)), 2 * near_rim(merged(level)));
}

TEST(MergedCells, TheSameBytesOnAnyNumberOfThreads) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed)
    EXPECT_TRUE(test::same_bytes(merged(waves(seed), 1), merged(waves(seed), 4)));
}

}  // namespace
}  // namespace polyhull::refine
