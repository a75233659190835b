// SPDX-License-Identifier: LGPL-2.1-or-later
// Motion blur against paths traced while the viewport moves.
#include "render/lens/motion_blur.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/thread_pool.h"
#include "glowing_stage.h"
#include "render/lens/lens_picture.h"
#include "support/run_kind.h"

namespace polyhull::test {
namespace {

// The paths take long.
const int paths_per_pose = at_length() ? 4 : 1;
const double noise = at_length() ? 0.0 : 4.0;  // dB, of the truth

/// How a viewport moves from a frame to the next.
struct Move {
  const char* name;
  Vec3 eye, target;  // by how much, metres
  double angle;      // of view, degrees
  double share;      // of the shutter
  double least;      // dB
};

Camera viewport_at(const Move& move, double frame) {
  return look_at(Vec3(0.3, 1.3, 4.2) + frame * move.eye, Vec3(0, 1.0, 0) + frame * move.target,
                 42.0 + frame * move.angle, width, height);
}

MotionBlur::Shutter shutter_of(const Move& move) {
  MotionBlur::Shutter shutter;
  shutter.before = viewport_at(move, -1.0);
  shutter.share = move.share;
  return shutter;
}

Picture truth(const TracedScene& scene, const Move& move, const PathOptions& paths = {}) {
  constexpr int poses = 24;
  std::vector<Vec3f> sums(static_cast<std::size_t>(width) * height, Vec3f(0.0f));
  for (int i = 0; i < poses; ++i)
    trace_paths(scene, viewport_at(move, move.share * ((i + 0.5) / poses - 0.5)),
                static_cast<std::uint32_t>(i * paths_per_pose), paths_per_pose, paths, sums);
  return develop(sums, paths_per_pose * poses, width, height);
}

Picture drawn(const Stage& stage, const MotionBlur::Shutter& shutter) {
  return stage.drawn([&](const LightLayers& sharp, LightLayers& moved) {
    MotionBlur().apply(stage.camera, shutter, stage.depths, sharp, moved);
  });
}

const Stage& stage() {
  static const Stage made;
  return made;
}

constexpr Move moves[] = {
    {"pan", {0, 0, 0}, {0.3, 0.05, 0}, 0, 0.5, 36.0},
    {"track", {0.25, 0, 0}, {0.25, 0, 0}, 0, 0.5, 36.0},
    {"wide", {0.3, 0.1, 0}, {0.3, 0.1, 0}, 0, 1.0, 33.0},
    {"dolly", {0, 0, -0.4}, {0, 0, 0}, 0, 0.5, 36.0},
    {"zoom", {0, 0, 0}, {0, 0, 0}, -4.0, 0.5, 36.0},
};

TEST(MotionBlur, IsNearToTheTruth) {
  for (const Move& move : moves) {
    const Picture drawn = test::drawn(stage(), shutter_of(move)),
                  truth = test::truth(stage().scene, move);
    const double found = psnr(drawn, truth), sharp = psnr(stage().with, truth);
    std::printf("%-6s %.1f dB (sharp %.1f dB)\n", move.name, found, sharp);
    keep(drawn, std::string("motion-") + move.name + ".png");
    keep(truth, std::string("motion-") + move.name + "-truth.png");
    EXPECT_GE(found, move.least - noise) << move.name;
    EXPECT_GE(found, sharp + 3.0) << move.name;
  }
}

// Both blurs, as a composite gets them.
TEST(MotionBlur, WithDepthOfFieldIsNearToTheTruth) {
  const Move& move = moves[1];
  ViewportLens lens;
  lens.aperture = 0.08;
  lens.focus_distance = 4.2;
  lens.shutter = move.share;
  PathOptions paths;
  paths.aperture = static_cast<float>(lens.aperture);
  paths.focus_distance = static_cast<float>(lens.focus_distance);
  RenderFrame frame = stage().frame;
  const Camera before = viewport_at(move, -1.0);
  LensPicture picture;
  picture.set(frame, lens, &before);
  EXPECT_TRUE(picture.moves());
  Picture drawn = stage().without;
  picture.draw(frame, stage().plan, 0, stage().without.pixels.data(), 4 * width,
               drawn.pixels.data(), 4 * width,
               [](const RenderPlan&, const std::uint8_t*, int, std::uint8_t* to, int stride) {
                 ASSERT_EQ(stride, 4 * width);
                 std::copy(stage().with.pixels.begin(), stage().with.pixels.end(), to);
               });
  const Picture truth = test::truth(stage().scene, move, paths);
  const double found = psnr(drawn, truth), sharp = psnr(stage().with, truth);
  std::printf("both   %.1f dB (sharp %.1f dB)\n", found, sharp);
  keep(drawn, "both.png");
  keep(truth, "both-truth.png");
  EXPECT_GE(found, 36.0 - noise);
  EXPECT_GE(found, sharp + 3.0);
}

TEST(MotionBlur, WhatIsNoLensIsRefused) {
  const double nan = std::nan("");
  const auto refused = [](const auto& change) {
    ViewportLens lens;
    change(lens);
    RenderFrame frame = stage().frame;
    EXPECT_THROW(LensPicture().set(frame, lens), Error);
  };
  for (const double value : {nan, -0.1, 1.1, HUGE_VAL}) {
    refused([value](ViewportLens& lens) { lens.aperture = value; });
    refused([value](ViewportLens& lens) { lens.shutter = value; });
  }
  for (const double value : {nan, 0.0, -1.0, HUGE_VAL})
    refused([value](ViewportLens& lens) { lens.focus_distance = value; });
  for (const double value : {nan, -0.1, HUGE_VAL})
    refused([value](ViewportLens& lens) { lens.grain = value; });
  refused([nan](ViewportLens& lens) { lens.falloff[1] = nan; });
}

// What stands still is as it was, to the bit.
TEST(MotionBlur, MovesOnlyWhereTheViewportDoes) {
  const Camera still = viewport_at(moves[0], 0.0);
  MotionBlur::Shutter shutter{still, 0.5, false};
  EXPECT_FALSE(MotionBlur::moves(still, shutter));
  EXPECT_EQ(drawn(stage(), shutter).pixels, stage().with.pixels);
  shutter = shutter_of(moves[0]);
  EXPECT_TRUE(MotionBlur::moves(still, shutter));
  shutter.share = 0.0;
  EXPECT_FALSE(MotionBlur::moves(still, shutter));
}

// What moves by less than a tenth of a pixel while the shutter is open is not seen to move.
TEST(MotionBlur, TheShuttersShareOfAMotionIsSeen) {
  Move slow{"slow", {0, 0, 0}, {1e-5, 0, 0}, 0, 1.0, 0.0};
  const Camera camera = viewport_at(slow, 0.0);
  while (!MotionBlur::moves(camera, shutter_of(slow))) slow.target *= 1.2;
  slow.share = 0.5;
  EXPECT_FALSE(MotionBlur::moves(camera, shutter_of(slow)));
  slow.target *= 2.0;
  EXPECT_TRUE(MotionBlur::moves(camera, shutter_of(slow)));
}

// What was blurred before, and on how many threads, changes nothing.
TEST(MotionBlur, RemembersNothing) {
  MotionBlur blur;
  LightLayers moved;
  std::vector<float> alone;
  for (const int threads : {0, 1, 0}) {
    set_pool_threads(threads);
    for (const Move& move : {moves[2], moves[0]}) {
      MotionBlur::Shutter shutter = shutter_of(move);
      shutter.subject_only = threads == 1 && move.share == 1.0;
      stage().drawn([&](const LightLayers& sharp, LightLayers& drawn) {
        blur.apply(stage().camera, shutter, stage().depths, sharp, moved);
        MotionBlur().apply(stage().camera, shutter, stage().depths, sharp, drawn);
        for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(moved.scene[c], drawn.scene[c]);
      });
    }
    if (alone.empty()) alone = moved.scene[0];
    EXPECT_EQ(moved.scene[0], alone);
  }
  set_pool_threads(0);
}

// Another camera is no motion.
TEST(MotionBlur, CutsAreNoMotion) {
  const Camera camera = viewport_at(moves[0], 0.0);
  for (const Camera& other : {look_at({0.3, 1.3, 4.2}, {4.0, 1.0, 0}, 42.0, width, height),
                              look_at({0.3, 1.3, -4.2}, {0, 1.0, 0}, 42.0, width, height),
                              look_at({6.2, 1.3, 4.2}, {6.0, 1.0, 0}, 42.0, width, height)})
    for (const double frames : {1.0, 4.0})
      EXPECT_TRUE(MotionBlur::is_cut(camera, other, frames)) << frames;
}

// Cameras around a subject that all aim at it: its middle stays in the picture's.
TEST(MotionBlur, CutsBetweenCamerasThatAimAtOneSubject) {
  const auto around = [](double degrees) {
    const double a = glm::radians(degrees);
    return look_at({2.7 * std::sin(a), 1.0, 2.7 * std::cos(a)}, {0, 1.0, 0}, 42.0, width, height);
  };
  for (const double degrees : {25.0, 40.0, 60.0, 180.0})
    EXPECT_TRUE(MotionBlur::is_cut(around(0.0), around(degrees), 1.0)) << degrees;
  for (const double degrees : {1.0, 5.0, 14.0})
    EXPECT_FALSE(MotionBlur::is_cut(around(0.0), around(degrees), 1.0)) << degrees;
  // A second without frames makes none of them one.
  for (const double degrees : {31.0, 40.0, 60.0, 180.0})
    EXPECT_TRUE(MotionBlur::is_cut(around(0.0), around(degrees), 25.0)) << degrees;
}

// A pan stays one where not every frame is drawn.
TEST(MotionBlur, PansOverSeveralFramesAreNoCuts) {
  for (const double fov : {42.0, 70.0}) {
    const auto panned = [fov](double degrees) {
      const double a = glm::radians(degrees);
      return look_at({0, 1, 0}, {std::sin(a), 1, -std::cos(a)}, fov, width, height);
    };
    for (const double degrees : {4.0, 7.0}) {
      EXPECT_FALSE(MotionBlur::is_cut(panned(0.0), panned(degrees), 1.0)) << degrees;
      EXPECT_FALSE(MotionBlur::is_cut(panned(0.0), panned(4.0 * degrees), 4.0)) << degrees;
      EXPECT_TRUE(MotionBlur::is_cut(panned(0.0), panned(4.0 * degrees), 1.0)) << degrees;
    }
    EXPECT_TRUE(MotionBlur::is_cut(panned(0.0), panned(16.0), 1.05));  // by a frame that is late
  }
}

TEST(MotionBlur, EvenSurfacesStayEven) {
  Stage even(viewport(), 1);
  std::fill(even.without.pixels.begin(), even.without.pixels.end(), std::uint8_t{140});
  even.with = even.without;
  const Picture drawn = test::drawn(even, shutter_of(moves[2]));
  for (std::size_t i = 0; i < drawn.pixels.size(); ++i)
    ASSERT_NEAR(drawn.pixels[i], i % 4 == 3 ? even.with.pixels[i] : 140, 1);
}

// With a background that has its motion blur, only the subject changes.
TEST(MotionBlur, TheSubjectAlone) {
  const Move& move = moves[1];
  Stage of;
  of.scene.set_subjects({});
  of.without = truth(of.scene, move);
  of.scene.set_subjects(traced(of.hull));
  for (std::size_t i = 0; i < of.with.pixels.size(); ++i)
    if (of.depths.coverage()[i / 4] == 0.0f) of.with.pixels[i] = of.without.pixels[i];
  MotionBlur::Shutter shutter = shutter_of(move);
  shutter.subject_only = true;
  const Picture drawn = test::drawn(of, shutter), truth = test::truth(of.scene, move);
  int changed_far = 0;
  for (std::size_t i = 0; i < drawn.pixels.size(); i += 4)
    if (static_cast<int>(i / 4 % width) > 3 * width / 4)
      changed_far += !std::equal(&drawn.pixels[i], &drawn.pixels[i] + 4, &of.with.pixels[i]);
  EXPECT_EQ(changed_far, 0);
  const double found = psnr(drawn, truth), sharp = psnr(of.with, truth);
  std::printf("subject alone: %.1f dB (sharp %.1f dB)\n", found, sharp);
  EXPECT_GE(found, sharp + 3.0);
}

}  // namespace
}  // namespace polyhull::test
