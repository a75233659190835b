// SPDX-License-Identifier: LGPL-2.1-or-later
// How near the refined surface comes to a body: the yardstick's figure at one instant, bounds a tenth
// above what was measured. All bodies and rigs: tests/benchmarks/body_benchmark.cpp.
#include <gtest/gtest.h>

#include <map>
#include <ostream>

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
};

void PrintTo(const Bar& bar, std::ostream* out) {
  *out << bar.rig << " cameras, quality " << static_cast<int>(bar.quality);
}

class RefinedBody : public testing::TestWithParam<Bar> {};

TEST_P(RefinedBody, IsNearTheBody) {
  const Bar& bar = GetParam();
  const BodyError error = measure(refined(seen_by(bar.rig), bar.quality), seen_by(bar.rig), false);
  EXPECT_EQ(error.unsound, 0.0);
  EXPECT_LT(error.mean, bar.mean);
  EXPECT_LT(error.hausdorff, bar.hausdorff);
  EXPECT_GT(error.overlap, bar.overlap);
  EXPECT_LT(error.missing, bar.missing);
  EXPECT_LT(error.outside, bar.outside);
  std::printf("%s: %.2f mm, %.1f mm, %.4f, %.3f %%, %.3f %%\n", bar.rig, error.mean,
              error.hausdorff, error.overlap, 100 * error.missing, 100 * error.outside);
}

INSTANTIATE_TEST_SUITE_P(
    Bars, RefinedBody,
    testing::Values(Bar{"4", RefineQuality::fast, 9.1, 52.0, 0.865, 0.0045, 0.0013},
                    Bar{"4", RefineQuality::good, 7.0, 32.0, 0.903, 0.0048, 0.0013},
                    Bar{"8", RefineQuality::fast, 2.6, 12.0, 0.974, 0.0039, 0.0011},
                    Bar{"8", RefineQuality::good, 2.3, 9.6, 0.977, 0.0039, 0.0011},
                    Bar{"8", RefineQuality::fine, 2.3, 10.6, 0.980, 0.0024, 0.0006}));

}  // namespace
}  // namespace polyhull::test
