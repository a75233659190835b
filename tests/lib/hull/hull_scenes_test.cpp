// SPDX-License-Identifier: LGPL-2.1-or-later
// HullBuilder on the scenes whose hull is known from another program (data/hull_scenes): closed,
// 2-manifold, oriented, filled where the silhouettes say so, of the known volume.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "hull/build/hull_builder.h"
#include "support/hull_expectations.h"

namespace polyhull::test {
namespace {

std::vector<std::string> scene_files() {
  std::vector<std::string> files;
  const char* data = std::getenv("POLYHULL_DATA");
  const std::filesystem::path folder = std::filesystem::path(data ? data : "") / "hull_scenes";
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
    if (entry.path().extension() == ".json") files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// The number of random points per scene; POLYHULL_POINTS=1000000 for all.
std::size_t point_count() {
  const char* text = std::getenv("POLYHULL_POINTS");
  return text ? std::strtoull(text, nullptr, 10) : 100000;
}

/// The references' cones were cut at 4.2 +- 1.6 units from the camera (times the scene's scale):
/// does the hull reach beyond?
bool reference_was_cut(const Hull& hull, const HullScene& scene, double scale) {
  for (const Camera& camera : scene.rig.cameras) {
    for (const Vec3f& v : hull.vertices) {
      const double depth = camera.to_camera(hull.origin + Vec3(v)).z;
      if (depth < 2.6 * scale || depth > 5.8 * scale) return true;
    }
  }
  return false;
}

TEST(HullScenes, AllAreRight) {
  const auto files = scene_files();
  if (files.empty())
    GTEST_SKIP() << "no hull_scenes: set POLYHULL_DATA to the folder that holds them";
  HullBuilder builder;
  std::size_t compared = 0;
  for (const std::string& file : files) {
    const HullScene scene = load_hull_scene(file);
    const auto views = scene.views();
    const Hull hull = builder.build(views);
    const MeshReport mesh = check_mesh(hull);
    EXPECT_TRUE(mesh.sound()) << scene.name << ": " << mesh.describe();
    EXPECT_FALSE(hull.empty()) << scene.name;
    if (!mesh.sound() || hull.empty()) continue;
    const PlaneReport planes = check_planes(hull, views, {});
    EXPECT_EQ(planes.flipped, 0u) << scene.name << ": triangles turned by rounding to float";
    EXPECT_EQ(planes.wrong_side + planes.bad_source, 0u)
        << scene.name << ": " << planes.flipped << " flipped, " << planes.wrong_side
        << " wrong side";
    EXPECT_LE(planes.worst_distance, 4 * rounding_of(hull)) << scene.name;

    Bounds box = box_of(hull, 0.02);
    if (scene.rig.bounds) box = join(box, *scene.rig.bounds);
    const auto points = compare_membership(hull, views, {}, box, point_count(), 12345);
    EXPECT_EQ(points.wrong(), 0u) << scene.name << ": " << points.missing << " missing, "
                                  << points.extra << " extra, the worst " << points.worst_distance
                                  << " from the surface";
    EXPECT_EQ(points.undecided, 0u) << scene.name;

    const double scale = glm::length(scene.rig.cameras[0].t) < 1e-3 ? 1e-6
                         : scene.name.rfind("huge", 0) == 0         ? 1e6
                                                                    : 1.0;
    const bool cut = reference_was_cut(hull, scene, scale);
    const double error = mesh.volume / scene.reference_volume.value() - 1.0;
    std::printf(
        "%-24s %6zu vertices %6zu triangles, volume %.9g (%+.1e%s), %.2f %% slivers, exact %.4f "
        "%%\n",
        scene.name.c_str(), mesh.vertices, mesh.triangles, mesh.volume, error,
        cut ? "; the reference was cut by its depth clip" : "", 100 * mesh.sliver_share(),
        100.0 * double(builder.statistics().exact_predicates) /
            double(std::max<std::uint64_t>(builder.statistics().predicates, 1)));
    if (cut) {
      EXPECT_GT(error, -1e-6) << scene.name;
      continue;
    }
    ++compared;
    EXPECT_LT(std::abs(error), 1e-6) << scene.name;
  }
  EXPECT_GE(compared, files.size() / 2) << "most references are not cut";
}

// The figures are 1.7 units tall: 3e-5 of the box's diagonal is a tenth of a millimetre there. Two
// cameras alone, as in dup_figure_N4, leave a bundle of long needles, which takes a hundred times
// that.
TEST(HullScenes, AtMostOnePercentSliversWithSimplification) {
  const auto files = scene_files();
  if (files.empty())
    GTEST_SKIP() << "no hull_scenes: set POLYHULL_DATA to the folder that holds them";
  HullBuilder builder;
  for (const std::string& file : files) {
    const HullScene scene = load_hull_scene(file);
    const auto views = scene.views();
    const Hull exact = builder.build(views);
    const Bounds box = box_of(exact, 0.0);
    const double relative = scene.name == "dup_figure_N4_n200" ? 3e-3 : 3e-5;
    HullOptions options;
    options.max_deviation = relative * glm::length(box.max - box.min);
    const Hull& hull = builder.build(views, options);
    const MeshReport mesh = check_mesh(hull);
    EXPECT_TRUE(mesh.sound()) << scene.name << ": " << mesh.describe();
    EXPECT_LE(mesh.sliver_share(), 0.01) << scene.name << ": " << mesh.describe();
    EXPECT_EQ(check_planes(hull, views, options).flipped, 0u) << scene.name;
    EXPECT_NEAR(mesh.volume / check_mesh(exact).volume, 1.0, relative) << scene.name;
    const auto points = compare_membership(hull, views, {}, box, point_count() / 10, 54321);
    EXPECT_LE(points.worst_distance, options.max_deviation * (1 + 1e-3)) << scene.name;
  }
}

TEST(HullScenes, OrderAndThreadsAndTurnedRings) {
  const auto files = scene_files();
  if (files.empty())
    GTEST_SKIP() << "no hull_scenes: set POLYHULL_DATA to the folder that holds them";
  for (const std::string& file : files) {
    const HullScene scene = load_hull_scene(file);
    if (scene.contour_vertices() > 3500) continue;
    auto views = scene.views();
    HullBuilder builder;
    HullOptions options;
    options.reuse = false;
    const Hull reference = builder.build(views, options);
    options.threads = 3;
    EXPECT_TRUE(same_bytes(builder.build(views, options), reference)) << scene.name;
    std::reverse(views.begin(), views.end());
    const Hull& reversed = builder.build(views, options);
    const MeshReport mesh = check_mesh(reversed);
    EXPECT_TRUE(mesh.sound()) << scene.name << ", cameras reversed: " << mesh.describe();
    EXPECT_NEAR(mesh.volume / check_mesh(reference).volume, 1.0, 1e-7) << scene.name;
  }
}

}  // namespace
}  // namespace polyhull::test
