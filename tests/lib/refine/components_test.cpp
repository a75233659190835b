// SPDX-License-Identifier: LGPL-2.1-or-later
// Pieces of the refined surface that no silhouette needs are dropped, all others stay; handles a hair
// thin are cut. How many there would be: tests/benchmarks/loose_benchmark.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <tuple>

#include "base/picture.h"
#include "hull/build/stage.h"
#include "hull/measure.h"
#include "refine/field/cell_surface.h"
#include "refine/field/contact_rays.h"
#include "refine/field/fine_field.h"
#include "refine/pieces/components.h"
#include "refine/pieces/handles.h"
#include "refine/refine.h"
#include "rig/rig.h"
#include "silhouette/blur/blur.h"
#include "silhouette/contour/contourer.h"
#include "support/camera_contours.h"
#include "support/figure.h"
#include "support/mesh_checks.h"
#include "support/scenes.h"

namespace polyhull::test {
namespace {

struct Made {
  Hull surface;
  RefineStatistics statistics;
  std::size_t pieces = 0;
};

Made refined(const HullScene& scene, const RefineSettings& settings) {
  const auto views = camera_contours(scene.rig.cameras, scene.silhouettes);
  HullOptions options;
  options.bounds = scene.rig.bounds;
  HullStage stage;
  HullRefiner refiner;
  Made made;
  made.surface = refiner.refine(stage.build(views, options, 0.0), views, 1.0, settings);
  made.statistics = refiner.statistics();
  const auto parts = connected_parts(made.surface);
  made.pieces = std::set(parts.begin(), parts.end()).size();
  return made;
}

HullScene seen(const std::vector<Capsule>& body, int cameras, double step) {
  HullScene scene;
  scene.rig = ring_of_cameras(cameras, 3.5);
  for (const Camera& camera : scene.rig.cameras)
    scene.silhouettes.push_back(silhouette_of(body, camera, step));
  return scene;
}

/// Every outline somewhere else, by up to \p pixels, and wandering as much.
HullScene contradicting(HullScene scene, double pixels, std::uint64_t seed) {
  Dice dice(seed);
  for (Rings& rings : scene.silhouettes) {
    const Vec2f shift(dice.between(-pixels, pixels), dice.between(-pixels, pixels));
    for (Vec2f& point : rings.points)
      point += shift + 0.5f * Vec2f(dice.between(-pixels, pixels), dice.between(-pixels, pixels));
  }
  return scene;
}

TEST(Components, CrumbsWhereOutlinesContradictAreDropped) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const HullScene scene =
        contradicting(seen(walking_figure(0.4 * static_cast<double>(seed)), 8, 8.0), 2.0, seed);
    RefineSettings settings{.quality = seed % 2 ? RefineQuality::fine : RefineQuality::good,
                            .threads = 1};
    const Made made = refined(scene, settings);
    EXPECT_EQ(made.pieces, 1u) << seed;
    EXPECT_GT(made.statistics.pieces_dropped, 0u) << seed;
    EXPECT_TRUE(check_mesh(made.surface).sound()) << seed;
    settings.threads = 3;
    EXPECT_TRUE(same_bytes(refined(scene, settings).surface, made.surface)) << seed;
  }
}

// A hand of which no camera sees the arm is such a ball as well.
TEST(Components, WhatASilhouetteNeedsStays) {
  struct Ball {
    Vec3 middle;
    double radius;
  };
  for (const Ball& ball : {Ball{{0.5, 0.4, 0.5}, 0.11}, Ball{{0.0, -0.5, 0.3}, 0.033},
                           Ball{{-0.45, 0.0, -0.2}, 0.02}}) {
    std::vector<Capsule> body = walking_figure(0.4);
    body.push_back({ball.middle, ball.middle, ball.radius});
    const HullScene scene = contradicting(seen(body, 8, 4.0), 1.0, 3);
    for (const RefineQuality quality : {RefineQuality::good, RefineQuality::fine}) {
      const Made made = refined(scene, {.quality = quality});
      EXPECT_EQ(made.pieces, 2u) << ball.radius;
      double nearest = 1.0;
      for (const Vec3f& v : made.surface.vertices)
        nearest = std::min(nearest, glm::length(made.surface.origin + Vec3(v) - ball.middle));
      EXPECT_NEAR(nearest, ball.radius, 0.02) << ball.radius;
    }
  }
}

// A real person, eight cameras, whose outlines contradict each other by some pixels.
TEST(Components, ARealPersonIsInOnePiece) {
  const char* data = std::getenv("POLYHULL_DATA");
  const std::string folder =
      std::string(data ? data : "") + "/../cases/31-real-silhouettes-crumbs/";
  if (!std::filesystem::exists(folder + "rig.json"))
    GTEST_SKIP() << "needs cases/31-real-silhouettes-crumbs beside $POLYHULL_DATA";
  const Rig rig = load_rig(folder + "rig.json");
  HullScene scene;
  scene.rig.cameras = rig.cameras;
  scene.rig.bounds = *rig.bounds;
  Blur blur;
  for (const Camera& camera : rig.cameras) {
    const Picture mask = load_picture(folder + camera.name + ".png", 1);
    Matte matte;
    load_matte(mask.pixels.data(), mask.width, 1, mask.width, mask.height, matte);
    Field field;
    blur.set({});
    blur.apply(matte, field);
    scene.silhouettes.push_back(Contourer().find(field, {}));
  }
  for (const RefineQuality quality : {RefineQuality::good, RefineQuality::fine}) {
    const Made made = refined(scene, {.quality = quality});
    EXPECT_EQ(made.pieces, 1u);
    EXPECT_GE(made.statistics.pieces_dropped, 4u);
  }
}

/// A grid on which all is outside.
refine::Level empty_level(int nx, int ny, int nz) {
  refine::Level level;
  level.grid = {Vec3f(0.0f), 0.5f, nx, ny, nz};
  level.values.assign(level.grid.size(), -1.0f);
  level.hull.assign(level.grid.size(), 1.0f);
  level.rows.assign(static_cast<std::size_t>(ny) * nz, {0, nx});
  return level;
}

/// A body, larger than what tests put beside it, at x of up to 9.
refine::Level level_with_body() {
  refine::Level level = empty_level(40, 20, 20);
  for (int z = 5; z < 15; ++z)
    for (int y = 5; y < 15; ++y)
      for (int x = 2; x < 10; ++x) level.values[level.grid.node(x, y, z)] = 1.0f;
  return level;
}

/// A ray with its rim at node (x, y, z), from a silhouette that is on the side of larger x.
refine::ContactRay ray_at(const refine::Level& level, int x, int y, int z, const Vec3f& way) {
  refine::ContactRay ray;
  ray.origin = level.grid.position(x, y, z) - 20.0f * way;
  ray.direction = way;
  ray.normal = Vec3f(-1.0f, 0.0f, 0.0f);
  ray.depth = 20.0f;
  return ray;
}

std::size_t dropped(refine::Level& level, const refine::ContactRays& rays) {
  return refine::drop_unneeded_components({&level, 1}, {refine::find_runs(level, 0.0f)}, rays, 1.2f,
                                          0.2f, 1);
}

/// Whether a piece of \p nodes nodes stays where an outline, of \p count rays, passes it \p beside its first
/// one.
bool stays(int nodes, float beside, std::size_t count = 2) {
  refine::Level level = level_with_body();
  for (int i = 0; i < nodes; ++i)
    level.values[level.grid.node(30 + i % 2, 10 + i / 2 % 2, 10 + i / 4)] = 1.0f;
  refine::ContactRays rays;
  rays.rays.assign(count, ray_at(level, 30, 10, 10, Vec3f(0.0f, 0.0f, 1.0f)));
  for (refine::ContactRay& ray : rays.rays) ray.origin.x -= beside;
  return dropped(level, rays) == 0;
}

// The surface is a quarter of a cell beside the nodes, a pixel a fifth of one.
TEST(Components, OnesThatCoverNoPixelOfTheRayAreDropped) {
  for (const int nodes : {1, 8}) {
    EXPECT_TRUE(stays(nodes, 0.0f));
    EXPECT_FALSE(stays(nodes, 0.0f, 1));
    EXPECT_TRUE(stays(nodes, 0.4f));
    EXPECT_FALSE(stays(nodes, 0.5f));
    EXPECT_FALSE(stays(nodes, 2.0f));
    EXPECT_EQ(stays(nodes, -0.1f), nodes == 8);
  }
}

// Of two pieces one behind the other, the larger one is what an outline needs, until another needs the
// smaller one.
TEST(Components, OnesThatSmallerOnesMakeNeedlessAreDropped) {
  for (const bool second : {false, true}) {
    refine::Level level = level_with_body();
    for (int z = 4; z < 8; ++z) level.values[level.grid.node(30, 10, z)] = 1.0f;
    for (int z = 14; z < 16; ++z) level.values[level.grid.node(30, 10, z)] = 1.0f;
    refine::ContactRays rays;
    rays.rays.assign(2, ray_at(level, 30, 10, 5, Vec3f(0.0f, 0.0f, 1.0f)));
    if (second)
      rays.rays.insert(rays.rays.end(), 2, ray_at(level, 30, 10, 14, Vec3f(0.0f, 1.0f, 0.0f)));
    EXPECT_EQ(dropped(level, rays), 1u);
    EXPECT_EQ(level.values[level.grid.node(30, 10, 5)] > 0.0f, !second);
    EXPECT_EQ(level.values[level.grid.node(30, 10, 14)] > 0.0f, second);
  }
}

/// A frame of three broad sides, and one of single nodes of depth \p thin.
refine::Level ring(float thin) {
  refine::Level level = empty_level(16, 12, 8);
  for (int z = 3; z < 6; ++z)
    for (int y = 2; y < 10; ++y)
      for (int x = 2; x < 14; ++x)
        if (x < 4 || x > 11 || y < 4) level.values[level.grid.node(x, y, z)] = 1.0f;
  for (int x = 4; x < 12; ++x) level.values[level.grid.node(x, 8, 4)] = thin;
  return level;
}

TEST(Handles, AreCutWhereTheyAreThinAndNotNeeded) {
  std::vector<std::uint32_t> labels;
  for (const auto& [thin, needed] : {std::pair(0.03f, false), {0.03f, true}, {0.3f, false}}) {
    const bool cut = thin < 0.05f && !needed;
    refine::Level level = ring(thin);
    const refine::LevelRuns before = refine::find_runs(level, 0.0f);
    EXPECT_EQ(before.components, 1u);
    EXPECT_EQ(before.handles, 1);
    EXPECT_EQ(refine::cut_thin_handles(
                  level, before, 0.05f, [is = needed](const Vec3f&) { return is; }, labels),
              cut ? 1u : 0u);
    const refine::LevelRuns after = refine::find_runs(level, 0.0f);
    EXPECT_EQ(after.components, 1u);
    EXPECT_EQ(after.handles, cut ? 0 : 1);
  }
}

// A hollow within a body takes nothing from its handles. The outside hangs together over corners, too:
// what one opens is no hollow.
TEST(Handles, AreCutBesideAHollow) {
  std::vector<std::uint32_t> labels;
  refine::Level level = ring(0.03f);
  for (int z = 2; z < 7; ++z)
    for (int x = 9; x < 14; ++x)
      for (int y = 2; y < 7; ++y) level.values[level.grid.node(x, y, z)] = 1.0f;
  for (const auto& [x, y] : {std::pair(11, 4), {11, 5}})
    level.values[level.grid.node(x, y, 4)] = -0.5f;
  const refine::LevelRuns before = refine::find_runs(level, 0.0f);
  EXPECT_EQ(before.handles, 1);
  EXPECT_EQ(before.hollows, 1u);
  const auto never = [](const Vec3f&) { return false; };
  EXPECT_EQ(refine::cut_thin_handles(level, before, 0.05f, never, labels), 1u);
  const refine::LevelRuns after = refine::find_runs(level, 0.0f);
  EXPECT_EQ(after.handles, 0);
  EXPECT_EQ(after.hollows, 1u);
  for (const auto& [x, y, z] : {std::tuple(10, 3, 3), {9, 2, 2}})
    level.values[level.grid.node(x, y, z)] = -0.5f;
  EXPECT_EQ(refine::find_runs(level, 0.0f).hollows, 0u);
}

// What is thin but no handle is left as it is: a ring whose hole is filled less deep, and an end.
TEST(Handles, WhatIsNoneStays) {
  std::vector<std::uint32_t> labels;
  for (const bool open : {false, true}) {
    refine::Level level = ring(0.04f);
    for (int y = 4; y < 8; ++y)
      for (int x = 4; x < 12; ++x) level.values[level.grid.node(x, y, 4)] = open ? -0.1f : 0.01f;
    if (open) level.values[level.grid.node(7, 8, 4)] = -0.1f;
    const std::vector<float> values = level.values;
    const auto never = [](const Vec3f&) { return false; };
    EXPECT_EQ(refine::cut_thin_handles(level, refine::find_runs(level, 0.0f), 0.05f, never, labels),
              0u);
    EXPECT_EQ(level.values, values);
  }
}

// A node that has to wait is tried again for each neighbour that goes back.
TEST(Handles, ANodeIsAskedAboutOnce) {
  std::vector<std::uint32_t> labels;
  refine::Level level = ring(0.04f);
  for (int y = 4; y < 8; ++y)
    for (int x = 4; x < 12; ++x)
      level.values[level.grid.node(x, y, 4)] =
          0.001f * static_cast<float>((x * 7 + y * 5) % 11 + 1);
  std::vector<Vec3f> asked;
  const auto never = [&](const Vec3f& node) {
    EXPECT_EQ(std::ranges::count(asked, node), 0);
    asked.push_back(node);
    return false;
  };
  refine::cut_thin_handles(level, refine::find_runs(level, 0.0f), 0.05f, never, labels);
  EXPECT_GT(asked.size(), 1u);
}

/// A slab with a hole of \p width nodes square along z, in which f is \p value and at one end -.2.
refine::Level tunnel(int width, float value) {
  refine::Level level = empty_level(24, 16, 12);
  for (int z = 3; z < 9; ++z)
    for (int y = 2; y < 14; ++y)
      for (int x = 2; x < 22; ++x) {
        const bool hole = x >= 8 && x < 8 + width && y >= 6 && y < 6 + width;
        level.values[level.grid.node(x, y, z)] = !hole ? 1.0f : z < 8 ? value : -0.2f;
      }
  return level;
}

TEST(Handles, TunnelsThatNoSilhouetteShowsAreFilledWhereTheyAreNarrowest) {
  std::vector<std::uint32_t> labels;
  for (const int width : {1, 3}) {
    refine::Level level = tunnel(width, -0.4f);
    const refine::LevelRuns before = refine::find_runs(level, 0.0f);
    EXPECT_EQ(before.handles, 1);
    EXPECT_EQ(refine::fill_narrow_tunnels(level, 0.5f, 0.05f, labels),
              static_cast<std::size_t>(width * width));
    EXPECT_EQ(level.values[level.grid.node(8, 6, 7)], -0.4f);
    EXPECT_EQ(level.values[level.grid.node(8, 6, 8)], 0.2f);
    const refine::LevelRuns after = refine::find_runs(level, 0.0f);
    EXPECT_EQ(after.handles, 0);
    EXPECT_EQ(after.components, 1u);
    EXPECT_EQ(after.hollows, 0u);
  }
}

// A wide tunnel, one that a silhouette shows, a dent, and a hollow; and what is filled is a hair thick
// where the hull is no thicker.
TEST(Handles, TunnelsThatAreWideOrSeenStay) {
  std::vector<std::uint32_t> labels;
  for (const char* what : {"wide", "seen", "dent", "hollow"}) {
    const std::string kind = what;
    refine::Level level = tunnel(1, -0.4f);
    for (int z = 0; z < 12; ++z) {
      const std::size_t node = level.grid.node(8, 6, z);
      if (kind == "wide") level.values[node] = -0.6f;
      if (kind == "seen") level.hull[node] = -0.1f;
    }
    if (kind == "dent" || kind == "hollow") level.values[level.grid.node(8, 6, 3)] = 1.0f;
    if (kind == "hollow") level.values[level.grid.node(8, 6, 8)] = 1.0f;
    const std::vector<float> values = level.values;
    EXPECT_EQ(refine::fill_narrow_tunnels(level, 0.5f, 0.05f, labels), 0u) << kind;
    EXPECT_EQ(level.values, values) << kind;
  }
  for (const auto& [hull, f, value] : {std::tuple(0.1f, -0.2f, 0.1f),
                                       {-0.03f, -0.2f, 0.02f},
                                       {refine::hull_far, -0.2f, 0.2f},
                                       {refine::hull_far, -0.35f, 0.25f}}) {
    refine::Level level = tunnel(1, -0.4f);
    const std::size_t node = level.grid.node(8, 6, 8);
    level.hull[node] = hull;
    level.values[node] = f;
    EXPECT_EQ(refine::fill_narrow_tunnels(level, 0.5f, 0.3f, labels), 1u);
    EXPECT_NEAR(level.values[node], value, 1e-6f);
  }
  // Between two nodes a hole may be a quarter of a cell farther outside than they are.
  for (const auto& [hull, filled] : {std::pair(-0.04f, 1u), {-0.06f, 0u}}) {
    refine::Level level = tunnel(1, -0.4f);
    for (int z = 0; z < 12; ++z) level.hull[level.grid.node(8, 6, z)] = hull;
    EXPECT_EQ(refine::fill_narrow_tunnels(level, 0.5f, 0.3f, labels), filled) << hull;
  }
}

// Beside the tunnel a dent with a narrow neck: once that is filled its end is a hollow, which what is
// around all may join.
TEST(Handles, ADentWithANeckIsNoTunnel) {
  std::vector<std::uint32_t> labels;
  refine::Level level = tunnel(1, -0.4f);
  for (int z = 5; z < 9; ++z) level.values[level.grid.node(14, 10, z)] = z == 5 ? -1.5f : -0.3f;
  EXPECT_EQ(refine::fill_narrow_tunnels(level, 0.5f, 0.05f, labels), 1u);
  for (int z = 6; z < 9; ++z) EXPECT_EQ(level.values[level.grid.node(14, 10, z)], -0.3f);
}

// Two posts on a beam, and from one to the other a stick of 16 mm on cells of 24.
TEST(Handles, AStickBetweenTwoPostsIsWhole) {
  const auto post = [](double x) { return Capsule{{x, 0.1, -0.3}, {x, 0.0, 0.35}, 0.07}; };
  const HullScene scene = seen({post(-0.3),
                                post(0.3),
                                {{-0.3, 0.1, -0.3}, {0.3, 0.1, -0.3}, 0.07},
                                {{-0.3, 0.0, 0.3}, {0.3, 0.02, 0.27}, 0.008}},
                               6, 2.0);
  const Made made = refined(scene, {});
  EXPECT_EQ(made.pieces, 1u);
  EXPECT_EQ(made.surface.vertices.size(), made.surface.triangles.size() / 6);  // one handle
}

TEST(Handles, AreCountedAsOnTheSurface) {
  for (int round = 0; round < 8; ++round) {
    refine::Level level = empty_level(48, 40, 40);
    for (int z = 1; z < 39; ++z)
      for (int y = 1; y < 39; ++y)
        for (int x = 1; x < 47; ++x)
          level.values[level.grid.node(x, y, z)] =
              static_cast<float>(std::sin(0.5 * x) + std::sin(0.45 * y + 0.4 * round) +
                                 std::sin(0.4 * z + 0.03 * x) - 0.3 * round + 0.7);
    const refine::LevelRuns runs = refine::find_runs(level, 0.0f);
    refine::CellSurface surface;
    refine::CellMarcher().march(level, surface, 1);
    const auto euler = static_cast<std::int64_t>(surface.points.size()) -
                       static_cast<std::int64_t>(surface.triangles.size() / 6);
    EXPECT_EQ(euler, 2 * (runs.components - runs.handles + std::int64_t{runs.hollows})) << round;
  }
}

}  // namespace
}  // namespace polyhull::test
