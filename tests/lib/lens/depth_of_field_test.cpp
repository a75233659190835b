// SPDX-License-Identifier: LGPL-2.1-or-later
// Depth of field against paths traced through a thin lens.
#include "render/lens/depth_of_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "base/thread_pool.h"
#include "glowing_stage.h"
#include "support/run_kind.h"

namespace polyhull::test {
namespace {

// The paths take long.
const int paths_per_pixel = at_length() ? 128 : 24;
const double noise = at_length() ? 0.0 : 4.0;  // dB, of the truth

Picture drawn(const Stage& stage, const ViewportLens& lens) {
  return stage.drawn([&](const LightLayers& sharp, LightLayers& focused) {
    DepthOfField().apply(stage.camera, lens, stage.depths, sharp, false, focused);
  });
}

Picture truth(const Stage& stage, const ViewportLens& lens) {
  PathOptions paths;
  paths.aperture = static_cast<float>(lens.aperture);
  paths.focus_distance = static_cast<float>(lens.focus_distance);
  return trace_picture(stage.scene, stage.camera, paths_per_pixel, paths);
}

const Stage& stage() {
  static const Stage made;
  return made;
}

ViewportLens lens_of(double aperture, double focus) {
  ViewportLens lens;
  lens.aperture = aperture;
  lens.focus_distance = focus;
  return lens;
}

TEST(DepthOfField, DepthsAreTheScenes) {
  const Camera camera = viewport();
  const DepthLayers& depths = stage().depths;
  const auto at = [&](const Vec3& point) {
    const Vec2 p = camera.project_ideal(point).value();
    return static_cast<std::size_t>(std::lround(p.y)) * width +
           static_cast<std::size_t>(std::lround(p.x));
  };
  for (const Vec3& point : {Vec3(-1.8, 1.7, -4.0), Vec3(-0.56, 1.5, 1.72), Vec3(1.0, 0.0, 0.5)}) {
    EXPECT_NEAR(depths.scene()[at(point)] * camera.to_camera(point).z, 1.0, 0.01);
    EXPECT_EQ(depths.coverage()[at(point)], 0.0f);
  }
  const Vec3 belly(-0.1, 0.9, 0.2);
  EXPECT_NEAR(depths.subject()[at(belly)] * camera.to_camera(belly).z, 1.0, 0.01);
  EXPECT_EQ(depths.coverage()[at(belly)], 1.0f);
  EXPECT_LT(depths.scene()[at(belly)], depths.subject()[at(belly)]);
}

TEST(DepthOfField, IsSharpWhereTheLensIsClosed) {
  const Picture drawn = test::drawn(stage(), lens_of(1e-6, 4.2));
  // Through linear light and back codes stay.
  EXPECT_EQ(drawn.pixels, stage().with.pixels);
}

// What was blurred before, and on how many threads, changes nothing.
TEST(DepthOfField, RemembersNothing) {
  DepthOfField blur;
  LightLayers focused;
  std::vector<float> alone;
  for (const int threads : {0, 1, 0}) {
    set_pool_threads(threads);
    for (const double focus : {2.5, 8.2}) {
      ViewportLens lens = lens_of(0.1, focus);
      lens.subject_only = threads == 1 && focus < 3.0;
      stage().drawn([&](const LightLayers& sharp, LightLayers& drawn) {
        blur.apply(stage().camera, lens, stage().depths, sharp, focus < 3.0, focused);
        DepthOfField().apply(stage().camera, lens, stage().depths, sharp, focus < 3.0, drawn);
        for (std::size_t c = 0; c < 4; ++c) {
          EXPECT_EQ(focused.subject[c], drawn.subject[c]);
          if (c < 3) {
            EXPECT_EQ(focused.scene[c], drawn.scene[c]);
          }
        }
      });
    }
    if (alone.empty()) alone = focused.scene[0];
    EXPECT_EQ(focused.scene[0], alone);
  }
  set_pool_threads(0);
}

TEST(DepthOfField, EvenSurfacesStayEven) {
  Stage even(viewport(), 1);
  std::fill(even.without.pixels.begin(), even.without.pixels.end(), std::uint8_t{140});
  even.with = even.without;
  const Picture drawn = test::drawn(even, lens_of(0.2, 2.5));
  for (std::size_t i = 0; i < drawn.pixels.size(); ++i) ASSERT_NEAR(drawn.pixels[i], 140, 1);
}

// With a background that has its depth of field, only the subject changes, and as the truth has it.
TEST(DepthOfField, TheSubjectAlone) {
  ViewportLens lens = lens_of(0.15, 8.2);
  lens.subject_only = true;
  Stage of;
  of.scene.set_subjects({});
  of.without = test::truth(of, lens);
  of.scene.set_subjects(traced(of.hull));
  // The pinhole's subject over the blurred scene.
  for (std::size_t i = 0; i < of.with.pixels.size(); ++i) {
    const float a = of.depths.coverage()[i / 4];
    if (a == 0.0f) of.with.pixels[i] = of.without.pixels[i];
  }
  const Picture drawn = test::drawn(of, lens), truth = test::truth(of, lens);
  int changed_far = 0;
  for (std::size_t i = 0; i < drawn.pixels.size(); i += 4) {
    const auto x = static_cast<int>(i / 4 % width);
    if (x > 3 * width / 4)
      changed_far += !std::equal(&drawn.pixels[i], &drawn.pixels[i] + 4, &of.with.pixels[i]);
  }
  EXPECT_EQ(changed_far, 0);
  const double found = psnr(drawn, truth), sharp = psnr(of.with, truth);
  std::printf("subject alone: %.1f dB (sharp %.1f dB)\n", found, sharp);
  EXPECT_GE(found, sharp + 3.0);
}

const Stage& behind_a_pillar() {
  static const Stage made(look_at({-1.2, 1.3, 4.2}, {-0.3, 1.0, 0}, 42.0, width, height));
  return made;
}

// All that is nearer than 3 m, the pillar above all, is white, all else dark, the subject too: the pillar's
// blur lies over it as over the wall.
TEST(DepthOfField, WhatIsBeforeTheSubjectIsBlurredOverIt) {
  const Stage& of = behind_a_pillar();
  Picture without = of.without;
  for (std::size_t i = 0; i < without.pixels.size(); ++i)
    without.pixels[i] = of.depths.scene()[i / 4] > 1.0f / 3.0f ? 220 : 20;
  const Picture with = without;  // the subject looks as what it hides
  const auto drawn = [&](const DepthLayers& depths) {
    LightLayers sharp, focused;
    sharp.read(depths, {without.pixels.data(), with.pixels.data(), 4 * width});
    DepthOfField().apply(of.camera, lens_of(0.1, 4.2), depths, sharp, false, focused);
    Picture out = with;
    focused.write(with.pixels.data(), 4 * width, out.pixels.data(), 4 * width);
    return out;
  };
  RenderFrame empty = of.frame;
  empty.subjects.clear();
  DepthLayers scene;
  scene.set(empty, {});
  const Picture both = drawn(of.depths), alone = drawn(scene);
  int most = 0, blurred = 0;
  for (std::size_t i = 0; i < both.pixels.size(); i += 4) {
    most = std::max(most, std::abs(both.pixels[i] - alone.pixels[i]));
    blurred += of.depths.coverage()[i / 4] == 1.0f && alone.pixels[i] > 40;
  }
  EXPECT_LE(most, 2);
  EXPECT_GT(blurred, 50);
}

// A blurred pillar stands before the subject, and a sharp one before a blurred subject.
TEST(DepthOfField, TheSubjectBehindAPillar) {
  const Stage& of = behind_a_pillar();
  for (const double focus : {4.2, 2.6}) {
    const ViewportLens lens = lens_of(0.1, focus);
    const Picture drawn = test::drawn(of, lens), truth = test::truth(of, lens);
    const double found = psnr(drawn, truth), sharp = psnr(of.with, truth);
    std::printf("behind a pillar, focus %.1f m: %.1f dB (sharp %.1f dB)\n", focus, found, sharp);
    keep(drawn, "dof-behind-" + std::to_string(focus) + ".png");
    keep(truth, "dof-behind-" + std::to_string(focus) + "-truth.png");
    EXPECT_GE(found, 39.6 - noise);
    EXPECT_GE(found, sharp + 3.0);
  }
}

struct Case {
  const char* name;
  double focus, aperture, least;
};

// Focus on the near pillar, the subject, and the wall.
TEST(DepthOfField, IsNearToTheTruth) {
  for (const Case& of : {Case{"pillar", 2.5, 0.05, 39.5}, Case{"subject", 4.2, 0.05, 37.5},
                         Case{"subject-wide", 4.2, 0.15, 38.0}, Case{"wall", 8.2, 0.05, 41.0},
                         Case{"wall-wide", 8.2, 0.15, 35.5}}) {
    const ViewportLens lens = lens_of(of.aperture, of.focus);
    const Picture drawn = test::drawn(stage(), lens), truth = test::truth(stage(), lens);
    const double found = psnr(drawn, truth), sharp = psnr(stage().with, truth);
    std::printf("%-12s focus %.1f m, aperture %.0f mm: %.1f dB (sharp %.1f dB)\n", of.name,
                of.focus, 1e3 * of.aperture, found, sharp);
    keep(drawn, std::string("dof-") + of.name + ".png");
    keep(truth, std::string("dof-") + of.name + "-truth.png");
    EXPECT_GE(found, of.least - noise) << of.name;
    EXPECT_GE(found, sharp + 1.5) << of.name;
  }
}

// Of pixels that are not square a disk is an ellipse, as of what anamorphic video stores.
TEST(DepthOfField, PixelsNeedNotBeSquare) {
  for (const auto& [ratio, least] : {std::pair(1.25, 40.7), std::pair(0.5, 40.0)}) {
    Camera camera = viewport();
    camera.K[1][1] *= ratio;
    const Stage of(camera);
    const ViewportLens lens = lens_of(0.15, 8.2);
    const Picture drawn = test::drawn(of, lens), truth = test::truth(of, lens);
    const double found = psnr(drawn, truth), sharp = psnr(of.with, truth);
    std::printf("pixels 1:%.2f: %.1f dB (sharp %.1f dB)\n", ratio, found, sharp);
    keep(drawn, "dof-pixels-" + std::to_string(ratio) + ".png");
    keep(truth, "dof-pixels-" + std::to_string(ratio) + "-truth.png");
    EXPECT_GE(found, least - noise) << ratio;
    EXPECT_EQ(test::drawn(of, lens_of(1e-6, 4.2)).pixels, of.with.pixels) << ratio;
  }
}

}  // namespace
}  // namespace polyhull::test
