// SPDX-License-Identifier: LGPL-2.1-or-later
// A hard shadow, pixel by pixel, against rays to the light's middle.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>
#include <vector>

#include "backend.h"
#include "figure_stage.h"
#include "simple_trace.h"

namespace polyhull {
namespace {

using HardShadowTest = testing::BackendTest;

// The shadow of the light's middle is that of rays from each pixel's own place, but for a border of a
// pixel: also where the pillar's own shadow and edges cross it.
TEST_P(HardShadowTest, AHardShadowIsExactToThePixel) {
  synthetic::FigureStage stage(640, 360, false);
  stage.fill_background(255);
  const synthetic::ShadowTruth truth(stage, 1, 1);
  RenderSettings settings;
  settings.shadow = ShadowQuality::hard;
  const Picture out = stage.composite(*make_renderer(), settings);
  const auto at = [](int x, int y) { return static_cast<std::size_t>(y) * 640 + x; };
  std::vector<float> taken(640 * 360, -1.0f);
  for (const auto& place : truth.places) taken[at(place.x, place.y)] = std::round(place.taken);
  int compared = 0, shaded = 0, lit_wrong = 0, shaded_wrong = 0, border = 0, border_wrong = 0;
  double worst = 0.0;
  for (const auto& place : truth.places) {
    const auto [x, y] = std::pair(place.x, place.y);
    const float share = taken[at(x, y)];  // all or nothing
    const std::uint8_t green = out.pixels[4 * at(x, y) + 1];
    // From the light's middle it is nearly what the whole light gave, which ends at black.
    const float albedo =
        stage.scene->materials[static_cast<std::size_t>(place.material)].base_colour.y;
    const float gave = albedo / std::numbers::pi_v<float> * place.light.y * stage.frame.exposure;
    const float found = synthetic::to_linear(green / 255.0f), dark = std::max(1.0f - gave, 0.0f);
    bool inside = x > 0 && y > 0 && x < 639 && y < 359;
    for (int j = -1; inside && j <= 1; ++j)
      for (int i = -1; i <= 1; ++i) inside = inside && taken[at(x + i, y + j)] == share;
    if (!inside) {
      ++border;
      border_wrong += gave > 0.05f && (found < 0.5f * (1.0f + dark)) != (share == 1.0f);
      continue;
    }
    ++compared;
    if (share == 0.0f) {
      lit_wrong += green != 255;
      continue;
    }
    ++shaded;
    const double error = std::abs(found - dark);
    worst = std::max(worst, error);
    shaded_wrong += error > 0.1 * gave + 0.013;  // a byte is .009 there
  }
  std::printf("%d of %d lit, %d of %d shaded and %d of %d border pixels are wrong, off by %.3f\n",
              lit_wrong, compared - shaded, shaded_wrong, shaded, border_wrong, border, worst);
  EXPECT_GT(shaded, 1500);
  EXPECT_EQ(lit_wrong, 0);
  EXPECT_EQ(shaded_wrong, 0);
  EXPECT_LE(border_wrong, processor() ? 0 : 5);
}

INSTANTIATE_TEST_SUITE_P(Api, HardShadowTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
