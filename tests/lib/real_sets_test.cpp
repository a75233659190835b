// SPDX-License-Identifier: LGPL-2.1-or-later
// What a real camera saw that was left out: the refined surface shows it better than the hull,
// blended better than from one camera each. All sets, ways and views: tests/benchmarks/leftout_benchmark.cpp.
#include "support/real_sets.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "mesh/texture_mesh.h"

namespace polyhull::test {
namespace {

std::string data() {
  const char* folder = std::getenv("POLYHULL_DATA");
  return folder ? folder : "";
}

/// Means over some cameras that were left out.
struct Means {
  Likeness inside, either;
  double overlap = 0.0;
};

Means means(const RealSet& set, Mesh& mesh, TextureMethod method,
            const std::vector<std::size_t>& left_out) {
  TextureSettings settings;
  settings.method = method;
  settings.metric = TextureMetric::viewing_angle;
  texture_mesh(mesh, settings);
  Means sum;
  const double share = 1.0 / static_cast<double>(left_out.size());
  for (const std::size_t k : left_out) {
    const Picture seen = seen_by(set.views[k]), drawn = drawn_for(set.views[k], mesh);
    const Likeness inside = likeness(drawn, seen, Within::silhouette),
                   either = likeness(drawn, seen, Within::either);
    sum.inside.psnr += share * inside.psnr;
    sum.inside.ssim += share * inside.ssim;
    sum.either.psnr += share * either.psnr;
    sum.either.ssim += share * either.ssim;
    sum.overlap += share * overlap(drawn, seen);
  }
  return sum;
}

/// By how much the refined surface is to beat the hull, and blending direct colours: four fifths of
/// what was measured.
struct Bar {
  double psnr, ssim, overlap, blend;
};

void expect_bars(const RealSet& set, std::size_t step, const std::vector<std::size_t>& left_out,
                 const Bar& bar) {
  std::vector<std::size_t> used;
  for (std::size_t k = 0; k < set.views.size(); k += step) used.push_back(k);
  Mesh mesh = hull_mesh(set, used);
  const Means hull = means(set, mesh, TextureMethod::blend, left_out);
  mesh.hull = refined_hull(mesh);
  const Means direct = means(set, mesh, TextureMethod::direct, left_out);
  const Means blend = means(set, mesh, TextureMethod::blend, left_out);
  EXPECT_GT(blend.inside.psnr, hull.inside.psnr + bar.psnr);
  EXPECT_GT(blend.inside.ssim, hull.inside.ssim + bar.ssim);
  EXPECT_GT(blend.either.psnr, hull.either.psnr + bar.psnr);
  EXPECT_GT(blend.overlap, hull.overlap + bar.overlap);
  EXPECT_GT(blend.inside.psnr, direct.inside.psnr + bar.blend);
  std::printf(
      "hull %.2f dB %.4f, %.2f dB, %.4f; refined %.2f dB %.4f, %.2f dB, %.4f; direct %.2f dB\n",
      hull.inside.psnr, hull.inside.ssim, hull.either.psnr, hull.overlap, blend.inside.psnr,
      blend.inside.ssim, blend.either.psnr, blend.overlap, direct.inside.psnr);
}

TEST(RealSets, TheOxfordDinosaurFromTwelveCameras) {
  const auto set = oxford_dinosaur(data());
  if (!set) GTEST_SKIP() << "needs oxford_dino under $POLYHULL_DATA";
  expect_bars(*set, 3, {1, 11, 22}, {0.45, 0.069, 0.012, 1.2});
}

TEST(RealSets, TheMiddleburyDinosaurFromEightCameras) {
  const auto set = middlebury_dinosaur(data());
  if (!set) GTEST_SKIP() << "needs middlebury_dinoSparseRing under $POLYHULL_DATA";
  expect_bars(*set, 2, {1, 9, 13}, {1.0, 0.042, 0.03, 1.0});
}

/// A camera that looks along z, and a picture of one grey with a square of another.
RealView square(double distortion) {
  RealView view;
  view.camera.width = 64, view.camera.height = 48;
  view.camera.K = Mat3(Vec3(60, 0, 0), Vec3(0, 60, 0), Vec3(31.5, 23.5, 1));
  if (distortion != 0.0) view.camera.distortion = {distortion, 0.0, 0.0, 0.0};
  view.picture = {64, 48, 4, std::vector<std::uint8_t>(64 * 48 * 4, 100)};
  for (int y = 10; y < 30; ++y)
    for (int x = 20; x < 50; ++x) view.picture.row(y)[4 * x] = 200;
  view.contours.points = {{19.5f, 9.5f}, {19.5f, 29.5f}, {49.5f, 29.5f}, {49.5f, 9.5f}};
  view.contours.ends = {4};
  return view;
}

TEST(RealSets, WhatACameraSawIsItsPictureInsideItsSilhouetteWithoutItsLens) {
  const RealView plain = square(0.0);
  const Picture seen = seen_by(plain);
  int inside = 0;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      const bool in = x >= 20 && x < 50 && y >= 10 && y < 30;
      ASSERT_EQ(seen.row(y)[4 * x + 3] == 255, in) << x << " " << y;
      ASSERT_EQ(seen.row(y)[4 * x], in ? 200 : seen.row(0)[0]) << x << " " << y;
      inside += in;
    }
  EXPECT_EQ(inside, 600);
  // A barrel lens moved the corners inwards; without it they are further out.
  const Picture straight = seen_by(square(-0.2));
  const Vec2 corner = square(-0.2).camera.undistort({49.5, 9.5});
  EXPECT_GT(corner.x, 50.0);
  EXPECT_EQ(straight.row(static_cast<int>(corner.y) + 2)[4 * (static_cast<int>(corner.x) - 1) + 3],
            255);
  EXPECT_NE(straight.row(static_cast<int>(corner.y) - 1)[4 * static_cast<int>(corner.x) + 3], 255);
}

TEST(RealSets, LikenessCountsWhereItSays) {
  const Picture seen = seen_by(square(0.0));
  EXPECT_EQ(likeness(seen, seen, Within::either).psnr, 99.0);
  EXPECT_NEAR(likeness(seen, seen, Within::either).ssim, 1.0, 1e-9);
  EXPECT_EQ(overlap(seen, seen), 1.0);
  Picture drawn = seen;
  for (int y = 10; y < 30; ++y)
    for (int x = 20; x < 50; ++x)
      for (int c = 0; c < 3; ++c) drawn.row(y)[4 * x + c] += 10;
  EXPECT_NEAR(likeness(drawn, seen, Within::silhouette).psnr, 20.0 * std::log10(25.5), 1e-9);
  const double inside = likeness(drawn, seen, Within::silhouette).ssim;
  EXPECT_LT(inside, 0.9999);
  // A stroke beside the silhouette: only `either` sees it.
  for (int x = 0; x < 60; ++x) drawn.row(40)[4 * x + 1] = 250;
  EXPECT_NEAR(likeness(drawn, seen, Within::silhouette).psnr, 20.0 * std::log10(25.5), 1e-9);
  EXPECT_EQ(likeness(drawn, seen, Within::silhouette).ssim, inside);
  const double squares = 600 * 3 * 100.0 + 60 * (250.0 - 24.0) * (250.0 - 24.0);
  EXPECT_NEAR(likeness(drawn, seen, Within::either).psnr,
              10.0 * std::log10(255.0 * 255.0 * 660 * 3 / squares), 1e-9);
  EXPECT_LT(likeness(drawn, seen, Within::either).ssim, inside);
  EXPECT_NEAR(overlap(drawn, seen), 600.0 / 660.0, 1e-12);
}

}  // namespace
}  // namespace polyhull::test
