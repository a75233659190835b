// SPDX-License-Identifier: LGPL-2.1-or-later
// The refined surface: sound whatever the scene, the same for any number of threads and any unit,
// inside the hull, touching every silhouette. How near to a body it is: refine_body_test.cpp.
#include "refine/refine.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "base/error.h"
#include "hull/build/stage.h"
#include "support/camera_contours.h"
#include "support/degenerate_scenes.h"
#include "support/figure.h"
#include "support/mesh_checks.h"
#include "support/scenes.h"

namespace polyhull::test {
namespace {

struct Refined {
  Hull hull, surface;
  RefineStatistics statistics;
};

std::vector<CameraContours> views_of(const HullScene& scene) {
  return camera_contours(scene.rig.cameras, scene.silhouettes);
}

Hull hull_of(const HullScene& scene) {
  HullOptions options;
  options.bounds = scene.rig.bounds;
  return HullStage().build(views_of(scene), options, 0.0);
}

Refined refine(const HullScene& scene, const RefineSettings& settings = {}, double unit = 1.0) {
  Refined out;
  out.hull = hull_of(scene);
  HullRefiner refiner;
  out.surface = refiner.refine(out.hull, views_of(scene), unit, settings);
  out.statistics = refiner.statistics();
  return out;
}

/// The longest side of the hull's box.
double size_of(const Hull& hull) {
  Vec3f low(1e30f), high(-1e30f);
  for (const Vec3f& v : hull.vertices) low = glm::min(low, v), high = glm::max(high, v);
  return std::max({high.x - low.x, high.y - low.y, high.z - low.z});
}

/// Two people: the walking figure here and there.
HullScene two_people(int cameras, const Vec3& apart) {
  HullScene scene;
  scene.rig = ring_of_cameras(cameras, 8.0);
  scene.silhouettes.resize(scene.rig.cameras.size());
  std::vector<Capsule> body = walking_figure(0.0);
  for (Capsule capsule : walking_figure(0.4)) {
    capsule.a += apart;
    capsule.b += apart;
    body.push_back(capsule);
  }
  for (std::size_t k = 0; k < scene.rig.cameras.size(); ++k)
    scene.silhouettes[k] = silhouette_of(body, scene.rig.cameras[k], 4.0);
  return scene;
}

void expect_sound(const Refined& made, const std::string& name) {
  const MeshReport report = check_mesh(made.surface);
  EXPECT_TRUE(report.sound()) << name << ": " << report.describe();
  EXPECT_EQ(report.flat_triangles, 0u) << name;
  EXPECT_EQ(made.surface.normals.size(), made.surface.vertices.size()) << name;
  for (const Vec3f& normal : made.surface.normals)
    ASSERT_NEAR(glm::length(normal), 1.0f, 1e-4f) << name;
}

TEST(Refine, AFigureIsSoundAndSmallerThanItsHull) {
  for (const int cameras : {4, 8}) {
    const Refined made = refine(figure_scene(cameras, 6.0));
    expect_sound(made, std::to_string(cameras) + " cameras");
    const double hull = check_mesh(made.hull).volume, volume = check_mesh(made.surface).volume;
    EXPECT_GT(volume, 0.6 * hull);
    EXPECT_LT(volume, 0.93 * hull);
    ASSERT_EQ(made.surface.faces.size(), 1u);
    EXPECT_EQ(made.surface.faces[0].edge, HullFace::no_edge);
    EXPECT_EQ(made.statistics.parts, 1u);
  }
}

TEST(Refine, NormalsPointOutOfTheSolid) {
  const Hull surface = refine(figure_scene(6, 6.0)).surface;
  std::size_t against = 0;
  for (std::size_t t = 0; t < surface.triangles.size(); t += 3) {
    const std::uint32_t* i = &surface.triangles[t];
    const Vec3f a = surface.vertices[i[0]];
    const Vec3f across = glm::cross(surface.vertices[i[1]] - a, surface.vertices[i[2]] - a);
    for (int k = 0; k < 3; ++k) against += glm::dot(across, surface.normals[i[k]]) <= 0.0f;
  }
  EXPECT_LT(static_cast<double>(against), 0.01 * static_cast<double>(surface.triangles.size()));
}

TEST(Refine, TheSameBytesForAnyNumberOfThreads) {
  const HullScene scene = two_people(5, {1.6, 0.3, 0.0});
  for (const RefineQuality quality : {RefineQuality::fast, RefineQuality::good}) {
    const Hull one = refine(scene, {.quality = quality, .threads = 1}).surface;
    for (const int threads : {2, 5, 0}) {
      const Hull other = refine(scene, {.quality = quality, .threads = threads}).surface;
      EXPECT_TRUE(same_bytes(one, other)) << threads;
      EXPECT_EQ(one.normals, other.normals) << threads;
    }
  }
}

TEST(Refine, RandomScenesAreSound) {
  const char* text = std::getenv("POLYHULL_STRESS");
  const int count = text ? 100 * std::atoi(text) : 60;
  int surfaces = 0;
  for (int seed = 1; seed <= count; ++seed) {
    const HullScene scene = random_scene(static_cast<std::uint64_t>(seed));
    const Hull hull = hull_of(scene);
    if (hull.empty()) continue;
    const double cell = size_of(hull) / (10.0 + seed % 4 * 15.0);
    expect_sound(refine(scene, {.quality = seed % 2 ? RefineQuality::fast : RefineQuality::good,
                                .cell = cell}),
                 "seed " + std::to_string(seed));
    ++surfaces;
  }
  EXPECT_GT(surfaces, count / 2);
}

TEST(Refine, DegenerateScenesAreSoundOrRefused) {
  int surfaces = 0;
  for (const DegenerateScene& degenerate : degenerate_scenes()) {
    Hull hull;
    try {
      hull = hull_of(degenerate.scene);
    } catch (const Error&) {
      continue;  // no hull, nothing to refine
    }
    if (hull.empty()) continue;
    const double cell = std::max(size_of(hull) / 40.0, 1e-9);
    try {
      expect_sound(refine(degenerate.scene, {.cell = cell}), degenerate.name);
      ++surfaces;
    } catch (const Error& error) {  // flatter than a cell
      EXPECT_NE(std::string(error.what()).find("Nothing is left"), std::string::npos)
          << degenerate.name << ": " << error.what();
    }
  }
  EXPECT_GT(surfaces, 10);
}

TEST(Refine, PeopleApartHaveGridsOfTheirOwn) {
  const Refined near = refine(two_people(8, {0.7, 0.0, 0.0}));
  const Refined far = refine(two_people(8, {2.0, 0.5, 0.0}));
  EXPECT_EQ(near.statistics.parts, 1u);
  EXPECT_GE(far.statistics.parts, 2u);
  expect_sound(near, "near");
  expect_sound(far, "far");
  EXPECT_LT(far.statistics.nodes, 2 * near.statistics.nodes);
  const double one = check_mesh(refine(figure_scene(8, 8.0)).surface).volume;
  EXPECT_NEAR(check_mesh(far.surface).volume, 2.0 * one, 0.1 * one);
}

// A ball above the head: however far, there is one surface of each.
TEST(Refine, PartsAboveEachOtherAreApart) {
  HullScene scene;
  scene.rig = ring_of_cameras(8, 8.0);
  scene.silhouettes.resize(scene.rig.cameras.size());
  const auto volume_with_ball = [&](double height) {
    std::vector<Capsule> body = walking_figure(0.0);
    const Vec3 middle(0.0, 0.0, height);
    if (height > 0.0) body.push_back({middle, middle, 0.12});
    for (std::size_t k = 0; k < scene.rig.cameras.size(); ++k)
      scene.silhouettes[k] = silhouette_of(body, scene.rig.cameras[k], 4.0);
    return check_mesh(refine(scene).surface).volume;
  };
  const double one = volume_with_ball(0.0);
  for (double height = 2.10; height < 2.40; height += 0.03)
    EXPECT_NEAR(volume_with_ball(height), one + 0.00724, 0.0013) << height;
}

// A stick of 8 mm on cells of 24: no node of the grid need be inside it.
TEST(Refine, AStickSurvives) {
  const Vec3 hand(0.35, 0.3, 1.0), end(0.47, 0.36, 1.18);
  std::vector<Capsule> body = walking_figure(0.0);
  body.push_back({hand, end, 0.004});
  HullScene scene = figure_scene(6, 8.0);
  for (std::size_t k = 0; k < scene.rig.cameras.size(); ++k)
    scene.silhouettes[k] = silhouette_of(body, scene.rig.cameras[k], 2.0);
  const Refined made = refine(scene);
  expect_sound(made, "stick");
  EXPECT_GT(made.statistics.thin_rays, 50u);
  for (double along = 0.05; along < 0.98; along += 0.02) {
    const Vec3 point = hand + along * (end - hand);
    double nearest = 1.0;
    for (const Vec3f& v : made.surface.vertices)
      nearest = std::min(nearest, glm::length(made.surface.origin + Vec3(v) - point));
    EXPECT_LT(nearest, 0.016) << along;
  }
}

TEST(Refine, TheUnitChangesNothingButNumbers) {
  const HullScene metres = figure_scene(4, 8.0);
  const HullScene millimetres = moved(metres, 1000.0, Vec3(0.0));
  const Hull a = refine(metres).surface, b = refine(millimetres, {}, 0.001).surface;
  ASSERT_EQ(a.vertices.size(), b.vertices.size());
  double most = 0.0;
  for (std::size_t i = 0; i < a.vertices.size(); ++i)
    most = std::max<double>(most, glm::length(1000.0f * a.vertices[i] - b.vertices[i]));
  EXPECT_LT(most, 2.0);  // mm: what rounding the contours to float makes of it
}

// A camera that sees nothing but foreground, far beyond its frame: the others make the hull.
TEST(Refine, OutlinesMayBeHuge) {
  HullScene scene = figure_scene(5, 8.0);
  scene.silhouettes[0].clear();
  add_ring(scene.silhouettes[0], {{-2e5f, -2e5f}, {-2e5f, 2e5f}, {2e5f, 2e5f}, {2e5f, -2e5f}});
  const Refined made = refine(scene);
  expect_sound(made, "huge");
  const double volume = check_mesh(made.surface).volume, hull = check_mesh(made.hull).volume;
  EXPECT_GT(volume, 0.4 * hull);
  EXPECT_LT(volume, 0.95 * hull);
}

TEST(Refine, BoundsHold) {
  HullScene scene = figure_scene(6, 6.0);
  scene.rig.bounds = Bounds{{-2.0, -2.0, 0.31}, {2.0, 2.0, 1.4}};
  const Refined made = refine(scene);
  expect_sound(made, "bounds");
  double low = 1e9, high = -1e9;
  for (const Vec3f& v : made.surface.vertices) {
    low = std::min(low, made.surface.origin.z + static_cast<double>(v.z));
    high = std::max(high, made.surface.origin.z + static_cast<double>(v.z));
  }
  EXPECT_GT(low, 0.31 - 1e-4);
  EXPECT_LT(high, 1.4 + 1e-4);
}

TEST(Refine, NothingOfTheLastInstantIsLeft) {
  HullRefiner refiner;
  const HullScene first = figure_scene(5, 8.0, 0.0), second = figure_scene(5, 8.0, 0.5);
  const Hull hull_a = hull_of(first), hull_b = hull_of(second);
  refiner.refine(hull_a, views_of(first), 1.0, {});
  const Hull after = refiner.refine(hull_b, views_of(second), 1.0, {});
  EXPECT_TRUE(same_bytes(after, refine(second).surface));
  EXPECT_FALSE(refiner.statistics().reused);
  EXPECT_TRUE(same_bytes(after, refiner.refine(hull_b, views_of(second), 1.0, {})));
  EXPECT_TRUE(refiner.statistics().reused);
  refiner.refine(hull_b, views_of(second), 1.0, {.quality = RefineQuality::fast});
  EXPECT_FALSE(refiner.statistics().reused);
}

TEST(Refine, OffAndEmptyPassAsTheyAre) {
  const HullScene scene = figure_scene(4, 12.0);
  const Refined made = refine(scene, {.quality = RefineQuality::off});
  EXPECT_TRUE(same_bytes(made.surface, made.hull));
  EXPECT_TRUE(HullRefiner().refine(Hull(), views_of(scene), 1.0, {}).empty());
}

void expect_refused(const HullScene& scene, Hull hull, double unit, const RefineSettings& settings,
                    const std::string& words) {
  try {
    HullRefiner().refine(hull, views_of(scene), unit, settings);
    FAIL() << "not refused: " << words;
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
}

TEST(Refine, SaysWhatIsWrong) {
  const HullScene scene = figure_scene(4, 12.0);
  const Hull hull = hull_of(scene);
  expect_refused(scene, hull, 0.0, {}, "metres to a unit");
  expect_refused(scene, hull, NAN, {}, "metres to a unit");
  expect_refused(scene, hull, 1.0, {.cell = -0.1}, "cell");
  expect_refused(scene, hull, 1.0, {.cell = NAN}, "cell");
  expect_refused(scene, hull, 1.0, {.cell = 1e-4}, "give a cell of 0.0");
  expect_refused(scene, hull, 1e4, {}, "million nodes");
  Hull broken = hull;
  broken.vertices[3].y = std::numeric_limits<float>::infinity();
  expect_refused(scene, broken, 1.0, {}, "not finite");
  HullScene bad = scene;
  bad.silhouettes[1].points[5].x = NAN;
  expect_refused(bad, hull, 1.0, {}, bad.rig.cameras[1].name);
  HullScene camera = scene;
  camera.rig.cameras[2].K[0][0] = NAN;
  expect_refused(camera, hull, 1.0, {}, camera.rig.cameras[2].name);
}

}  // namespace
}  // namespace polyhull::test
