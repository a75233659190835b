// SPDX-License-Identifier: LGPL-2.1-or-later
// The refined surface: sound, the same for any number of threads, inside the hull, touching it.
#include "refine/refine.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/degenerate_scenes.h"
#include "support/mesh_checks.h"
#include "support/scenes.h"

namespace polyhull::test {
namespace {

struct Refined {
  Hull hull, surface;
  RefineStatistics statistics;
};

Refined refine(const HullScene& scene, const RefineSettings& settings = {}, double unit = 1.0) {
  std::vector<CameraContours> views;
  for (std::size_t k = 0; k < scene.rig.cameras.size(); ++k)
    views.push_back({&scene.rig.cameras[k], &scene.silhouettes[k]});
  HullStage stage;
  HullOptions options;
  options.bounds = scene.rig.bounds;
  Refined out;
  out.hull = stage.build(views, options, 0.0);
  HullRefiner refiner;
  out.surface = refiner.refine(out.hull, views, unit, settings);
  out.statistics = refiner.statistics();
  return out;
}

TEST(Refine, AFigureIsSoundAndSmallerThanItsHull) {
  for (const int cameras : {4, 8}) {
    const Refined made = refine(figure_scene(cameras, 6.0));
    const MeshReport report = check_mesh(made.surface);
    EXPECT_TRUE(report.sound()) << report.describe();
    const double hull = check_mesh(made.hull).volume;
    EXPECT_GT(report.volume, 0.5 * hull);
    EXPECT_LT(report.volume, 0.95 * hull);
    std::printf("%d cameras: %zu rays, %zu triangles, volume %.4f of %.4f\n", cameras,
                std::size_t{made.statistics.rays}, report.triangles, report.volume, hull);
    const RefineStatistics& s = made.statistics;
    std::printf("distances %.1f rays %.1f flow %.1f plate %.1f fine %.1f surface %.1f ms\n",
                1e3 * s.seconds_distances, 1e3 * s.seconds_rays, 1e3 * s.seconds_flow,
                1e3 * s.seconds_plate, 1e3 * s.seconds_fine, 1e3 * s.seconds_surface);
  }
}

}  // namespace
}  // namespace polyhull::test
