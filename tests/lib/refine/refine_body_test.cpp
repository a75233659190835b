// SPDX-License-Identifier: LGPL-2.1-or-later
// How near the refined surface comes to a body: the yardstick's figure at one instant, bounds a tenth
// above what was measured. All bodies and rigs: tests/benchmarks/body_benchmark.cpp.
#include <gtest/gtest.h>

#include <map>
#include <ostream>

#include "hull/build/stage.h"
#include "refine/refine.h"
#include "support/body_scenes.h"
#include "support/camera_contours.h"

namespace polyhull::test {
namespace {

Hull refined(const BodyScene& scene, RefineQuality quality) {
  const std::vector<CameraContours> views = camera_contours(scene.cameras, scene.contours);
  HullStage stage;
  return HullRefiner().refine(hull_of(scene, stage, 0), views, 1.0, {.quality = quality});
}

const BodyScene& seen_by(const std::string& rig) {
  static std::map<std::string, BodyScene> scenes;
  const auto [place, is_new] = scenes.try_emplace(rig);
  if (is_new) place->second = body_scene(body_rig(rig), {"figure", open_subject("figure"), 3.0});
  return place->second;
}

struct Bar {
  const char* rig;
  RefineQuality quality;
  double mean, hausdorff, overlap, missing, outside;
  std::size_t triangles;
};

void PrintTo(const Bar& bar, std::ostream* out) {
  *out << bar.rig << " cameras, quality " << static_cast<int>(bar.quality);
}

class RefinedBodies : public testing::TestWithParam<Bar> {};

TEST_P(RefinedBodies, IsNearTheBody) {
  const Bar& bar = GetParam();
  const Hull surface = refined(seen_by(bar.rig), bar.quality);
  const BodyError error = measure(surface, seen_by(bar.rig), false);
  EXPECT_EQ(error.unsound, 0.0);
  EXPECT_LT(error.mean, bar.mean);
  EXPECT_LT(error.hausdorff, bar.hausdorff);
  EXPECT_GT(error.overlap, bar.overlap);
  EXPECT_LT(error.missing, bar.missing);
  EXPECT_LT(error.outside, bar.outside);
  EXPECT_LT(surface.triangles.size() / 3, bar.triangles);
  std::printf("%s: %.2f mm, %.1f mm, %.4f, %.3f %%, %.3f %%, %zu triangles\n", bar.rig, error.mean,
              error.hausdorff, error.overlap, 100 * error.missing, 100 * error.outside,
              surface.triangles.size() / 3);
}

INSTANTIATE_TEST_SUITE_P(
    Bars, RefinedBodies,
    testing::Values(Bar{"4", RefineQuality::fast, 6.8, 32.5, 0.903, 0.0060, 0.0050, 8000},
                    Bar{"4", RefineQuality::good, 6.0, 25.0, 0.924, 0.0063, 0.0038, 9000},
                    Bar{"8", RefineQuality::fast, 2.4, 10.9, 0.978, 0.0042, 0.0050, 8000},
                    Bar{"8", RefineQuality::good, 2.25, 9.8, 0.9795, 0.0041, 0.0038, 9500},
                    Bar{"8", RefineQuality::fine, 2.1, 8.8, 0.983, 0.0028, 0.0024, 17000}));

// Half a pixel of noise in every contour vertex moves the surface little more than the hull.
void expect_steady(const char* rig, double most) {
  HullStage stage;
  const BodyScene one = with_noise(seen_by(rig), 0.5, 3), other = with_noise(seen_by(rig), 0.5, 4);
  const TriangleSurface from = surface_of(hull_of(one, stage, 0)),
                        to = surface_of(hull_of(other, stage, 0));
  const double moved = distance_mm(surface_of(refined(one, RefineQuality::good)),
                                   surface_of(refined(other, RefineQuality::good)));
  const double ratio = moved / distance_mm(from, to);
  EXPECT_LT(ratio, most) << rig << " cameras";
  std::printf("%s: %.2f mm, %.2f times the hull\n", rig, moved, ratio);
}

TEST(RefinedBody, IsSteady) {
  expect_steady("4", 1.45);
  expect_steady("8", 1.2);
}

}  // namespace
}  // namespace polyhull::test
