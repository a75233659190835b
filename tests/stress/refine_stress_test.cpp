// SPDX-License-Identifier: LGPL-2.1-or-later
// HullRefiner on random rigs and bodies, on two and three people, on the hull's scenes in special
// position and on the files of data/hull_scenes: closed, oriented, a 2-manifold, no two triangles
// crossing (by CGAL, where it is built: -Dbenchmarks=true), the same bytes for one and three
// threads. POLYHULL_STRESS multiplies the counts: 1 (default) takes seconds, 250 gives ten thousand
// rigs and a thousand and more of each other kind; seeds are counted from POLYHULL_SEED (default 0).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "base/error.h"
#include "refine/refine.h"
#include "support/camera_contours.h"
#if POLYHULL_CGAL
#include "support/cgal_self_intersections.h"
#endif
#include "hull/build/stage.h"
#include "support/degenerate_scenes.h"
#include "support/figure.h"
#include "support/mesh_checks.h"
#include "support/scenes.h"

namespace polyhull::test {
namespace {

std::uint64_t number_from(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text ? std::strtoull(text, nullptr, 10) : otherwise;
}

/// What all surfaces of a test were.
struct Tally {
  std::size_t surfaces = 0, nothing = 0, triangles = 0;
};

double size_of(const Hull& hull) {
  Vec3f low(1e30f), high(-1e30f);
  for (const Vec3f& v : hull.vertices) low = glm::min(low, v), high = glm::max(high, v);
  return std::max({high.x - low.x, high.y - low.y, high.z - low.z});
}

void expect_right(const Hull& surface, const std::string& name, Tally& tally) {
  const MeshReport report = check_mesh(surface);
  EXPECT_TRUE(report.sound()) << name << ": " << report.describe();
  EXPECT_EQ(report.flat_triangles, 0u) << name;
  EXPECT_EQ(surface.normals.size(), surface.vertices.size()) << name;
#if POLYHULL_CGAL
  EXPECT_EQ(count_self_intersections(surface), 0u) << name;
#endif
  ++tally.surfaces;
  tally.triangles += report.triangles;
}

/// The surface of \p scene on \p cells cells along the hull's longest side.
void refine_and_judge(const HullScene& scene, double cells, RefineQuality quality, Tally& tally) {
  const std::vector<CameraContours> views = camera_contours(scene.rig.cameras, scene.silhouettes);
  HullOptions options;
  options.bounds = scene.rig.bounds;
  HullStage stage;
  const Hull hull = stage.build(views, options, 0.0);
  if (hull.empty()) {
    ++tally.nothing;
    return;
  }
  RefineSettings settings{.quality = quality, .cell = size_of(hull) / cells, .threads = 1};
  HullRefiner one, three;
  try {
    const Hull& surface = one.refine(hull, views, 1.0, settings);
    expect_right(surface, scene.name, tally);
    settings.threads = 3;
    const Hull& other = three.refine(hull, views, 1.0, settings);
    EXPECT_TRUE(same_bytes(surface, other)) << scene.name;
    EXPECT_EQ(surface.normals, other.normals) << scene.name;
  } catch (const Error& error) {  // thinner than the cells everywhere
    EXPECT_NE(std::string(error.what()).find("Nothing is left"), std::string::npos)
        << scene.name << ": " << error.what();
    ++tally.nothing;
  }
}

RefineQuality quality_of(std::uint64_t seed) {
  constexpr RefineQuality all[] = {RefineQuality::fast, RefineQuality::good, RefineQuality::fine};
  return all[seed % 3];
}

template <class Make>
void expect_all_right(const char* what, std::uint64_t count, const Make& make) {
  const std::uint64_t first = number_from("POLYHULL_SEED", 0);
  count *= number_from("POLYHULL_STRESS", 1);
  Tally tally;
  for (std::uint64_t seed = first; seed < first + count && !::testing::Test::HasFailure(); ++seed) {
    HullScene scene = make(seed);
    scene.name += " (seed " + std::to_string(seed) + ")";
    refine_and_judge(scene, 12.0 + 7.0 * static_cast<double>(seed % 5), quality_of(seed), tally);
  }
  std::printf("%s: seeds from %llu, %zu surfaces, %zu of nothing, %zu triangles\n", what,
              static_cast<unsigned long long>(first), tally.surfaces, tally.nothing,
              tally.triangles);
  EXPECT_GE(tally.surfaces, count / 3);
}

/// Two or three walking figures anywhere on a stage of 2.4 units, seen by three to six cameras.
HullScene people(std::uint64_t seed) {
  Dice dice(seed ^ 0x9e091e);
  HullScene scene;
  scene.name = "people";
  scene.rig = ring_of_cameras(dice.whole(3, 6), 8.0);
  std::vector<Capsule> bodies;
  for (int person = 0; person < 2 + static_cast<int>(seed % 2); ++person) {
    const Vec3 place(0.1 * dice.whole(-12, 12), 0.1 * dice.whole(-12, 12), 0.0);
    for (Capsule capsule : walking_figure(0.1 * dice.whole(0, 30))) {
      capsule.a += place;
      capsule.b += place;
      bodies.push_back(capsule);
    }
  }
  for (const Camera& camera : scene.rig.cameras)
    scene.silhouettes.push_back(silhouette_of(bodies, camera, 12.0));
  return scene;
}

/// The scene with its cameras in another order and other first vertices in its rings, in a world
/// larger by a power of two: what coincides still does, but numbers round and cells lie elsewhere.
HullScene varied(HullScene scene, std::uint64_t seed) {
  Dice dice(seed ^ 0x5bec1a1);
  for (Rings& rings : scene.silhouettes) {
    std::uint32_t begin = 0;
    for (const std::uint32_t end : rings.ends) {
      if (end > begin)
        std::rotate(rings.points.begin() + begin,
                    rings.points.begin() + begin + dice.whole(0, static_cast<int>(end - begin) - 1),
                    rings.points.begin() + end);
      begin = end;
    }
  }
  for (std::size_t i = scene.silhouettes.size(); i > 1; --i) {
    const auto other = static_cast<std::size_t>(dice.whole(0, static_cast<int>(i) - 1));
    std::swap(scene.rig.cameras[i - 1], scene.rig.cameras[other]);
    std::swap(scene.silhouettes[i - 1], scene.silhouettes[other]);
  }
  return moved(scene, std::exp2(dice.whole(-3, 3)), Vec3(0.0));
}

TEST(RefineStress, RandomRigs) {
  expect_all_right("random rigs", 40, random_scene);
}

TEST(RefineStress, RandomPolygons) {
  expect_all_right("random polygons", 10, wild_scene);
}

TEST(RefineStress, TwoAndThreePeople) {
  expect_all_right("people", 4, people);
}

TEST(RefineStress, SpecialPositions) {
  const std::vector<DegenerateScene> scenes = degenerate_scenes();
  expect_all_right("special positions", scenes.size(), [&](std::uint64_t seed) {
    const DegenerateScene& degenerate = scenes[seed % scenes.size()];
    HullScene scene = varied(degenerate.scene, seed);
    scene.name = degenerate.name;
    return scene;
  });
}

TEST(RefineStress, SceneFiles) {
  const char* data = std::getenv("POLYHULL_DATA");
  const std::filesystem::path folder = std::filesystem::path(data ? data : "") / "hull_scenes";
  if (!std::filesystem::is_directory(folder))
    GTEST_SKIP() << "no hull_scenes: set POLYHULL_DATA to the folder that holds them";
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<HullScene> scenes;
  for (const std::filesystem::path& file : files) scenes.push_back(load_hull_scene(file));
  expect_all_right("scene files", scenes.size(),
                   [&](std::uint64_t seed) { return varied(scenes[seed % scenes.size()], seed); });
}

}  // namespace
}  // namespace polyhull::test
