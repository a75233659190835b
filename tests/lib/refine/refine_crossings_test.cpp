// SPDX-License-Identifier: LGPL-2.1-or-later
// No two triangles of a refined surface cross, after rounding to float: judged by CGAL.
#include <gtest/gtest.h>

#include "hull/build/stage.h"
#include "refine/refine.h"
#include "support/camera_contours.h"
#include "support/cgal_self_intersections.h"
#include "support/scenes.h"

namespace polyhull::test {
namespace {

Hull refined(const HullScene& scene, double cells) {
  const auto views = camera_contours(scene.rig.cameras, scene.silhouettes);
  HullOptions options;
  options.bounds = scene.rig.bounds;
  const Hull hull = HullStage().build(views, options, 0.0);
  if (hull.empty()) return hull;
  Vec3f low(1e30f), high(-1e30f);
  for (const Vec3f& v : hull.vertices) low = glm::min(low, v), high = glm::max(high, v);
  const Vec3f size = high - low;
  return HullRefiner().refine(hull, views, 1.0,
                              {.cell = double(std::max({size.x, size.y, size.z})) / cells});
}

TEST(RefinedCrossings, None) {
  EXPECT_EQ(count_self_intersections(refined(figure_scene(4, 6.0), 75.0)), 0u);
  EXPECT_EQ(count_self_intersections(refined(figure_scene(8, 6.0), 75.0)), 0u);
  EXPECT_EQ(count_self_intersections(refined(knot_scene(5, 6.0), 50.0)), 0u);
  for (std::uint64_t seed = 1; seed <= 40; ++seed)
    EXPECT_EQ(count_self_intersections(refined(random_scene(seed), 15.0 + 10.0 * (seed % 4))), 0u)
        << seed;
}

}  // namespace
}  // namespace polyhull::test
