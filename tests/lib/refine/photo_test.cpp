// SPDX-License-Identifier: LGPL-2.1-or-later
// Photo-consistency: hollows that no silhouette shows are carved, silhouettes stay covered, what is
// plain stays as it is. All bodies: tests/benchmarks/body_benchmark.cpp, --hollows.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>

#include "base/error.h"
#include "hull/build/stage.h"
#include "hull/measure.h"
#include "refine/refine.h"
#include "support/body_scenes.h"
#include "support/camera_contours.h"
#include "support/hollow_bodies.h"
#include "support/refusal.h"

namespace polyhull::test {
namespace {

const BodyScene& dented() {
  static const BodyScene scene = body_scene(body_rig("12"), hollow_bodies().front(), false);
  return scene;
}

Hull refined(const BodyScene& scene, const RefineSettings& settings) {
  HullStage stage;
  return HullRefiner().refine(hull_of(scene, stage, 0),
                              camera_contours(scene.cameras, scene.contours), 1.0, settings,
                              view_pixels(scene));
}

int pieces(const Hull& surface) {
  const std::vector<std::uint32_t> parts = connected_parts(surface);
  int count = 0;
  for (std::size_t v = 0; v < parts.size(); ++v) count += parts[v] == v;
  return count;
}

/// The share of the edges across which the surface turns by more than 60 degrees.
double sharp_share(const Hull& surface) {
  const std::vector<std::uint32_t>& corner = surface.triangles;
  std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3> normal_beside;
  int edges = 0, sharp = 0;
  for (std::size_t t = 0; t < corner.size(); t += 3) {
    const Vec3 a(surface.vertices[corner[t]]), b(surface.vertices[corner[t + 1]]),
        c(surface.vertices[corner[t + 2]]);
    const Vec3 normal = glm::normalize(glm::cross(b - a, c - a));
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t from = corner[t + k], to = corner[t + (k + 1) % 3];
      normal_beside[{from, to}] = normal;
      const auto other = normal_beside.find({to, from});
      if (other == normal_beside.end()) continue;
      ++edges;
      sharp += glm::dot(normal, other->second) < 0.5;
    }
  }
  return static_cast<double>(sharp) / edges;
}

TEST(Photo, CarvesHollowsAndKeepsSilhouettes) {
  const Hull surface = refined(dented(), {.photo = true});
  EXPECT_EQ(pieces(surface), 1);
  const BodyError plain = measure(refined(dented(), {}), dented(), false);
  const BodyError carved = measure(surface, dented(), false);
  EXPECT_EQ(carved.unsound, 0.0);
  EXPECT_LT(carved.mean, 0.4 * plain.mean);             // .38 measured
  EXPECT_LT(carved.hausdorff, 0.22 * plain.hausdorff);  // .207
  EXPECT_LT(carved.missing, 1.2 * plain.missing);
  EXPECT_LT(carved.outside, plain.outside + 1e-4);
  std::printf("%.2f to %.2f mm, %.1f to %.1f mm, missing %.3f to %.3f %%\n", plain.mean,
              carved.mean, plain.hausdorff, carved.hausdorff, 100 * plain.missing,
              100 * carved.missing);
}

TEST(Photo, MakesTheFigureNoWorse) {
  const BodyScene scene =
      body_scene(body_rig("12"), {"figure", open_subject("figure"), 3.0}, false);
  const Hull before = refined(scene, {}), surface = refined(scene, {.photo = true});
  EXPECT_LE(pieces(surface), pieces(before));
  EXPECT_LT(sharp_share(surface), 1.1 * sharp_share(before));
  const BodyError plain = measure(before, scene, false), carved = measure(surface, scene, false);
  EXPECT_LT(carved.mean, plain.mean);
  EXPECT_LT(carved.hausdorff, plain.hausdorff);
  EXPECT_LT(carved.missing, plain.missing + 1e-4);
  EXPECT_LT(carved.outside, plain.outside + 4e-4);
}

TEST(Photo, IsOfThesePicturesAndTheSameForAnyNumberOfThreads) {
  BodyScene scene = dented();
  const auto views = camera_contours(scene.cameras, scene.contours);
  HullStage stage;
  const Hull hull = hull_of(scene, stage, 0);
  HullRefiner refiner;
  const Hull one =
      refiner.refine(hull, views, 1.0, {.threads = 1, .photo = true}, view_pixels(scene));
  EXPECT_EQ(refined(scene, {.threads = 4, .photo = true}).vertices, one.vertices);
  // Other pictures of the same outlines: plain ones, by which nothing is carved.
  for (Picture& picture : scene.pictures)
    std::fill(picture.pixels.begin(), picture.pixels.end(), std::uint8_t{90});
  const Hull plain =
      refiner.refine(hull, views, 1.0, {.threads = 1, .photo = true}, view_pixels(scene));
  EXPECT_FALSE(refiner.statistics().reused);
  EXPECT_NE(plain.vertices, one.vertices);
  EXPECT_EQ(plain.vertices, refined(scene, {}).vertices);
}

TEST(Photo, AMissingPictureIsRefused) {
  const auto views = camera_contours(dented().cameras, dented().contours);
  HullStage stage;
  const Hull hull = hull_of(dented(), stage, 0);
  std::vector<ViewPixels> pixels = view_pixels(dented());
  pixels[3] = {};
  EXPECT_EQ(
      test::refusal_of([&] { HullRefiner().refine(hull, views, 1.0, {.photo = true}, pixels); }),
      "Camera cam3 sends no picture, by which photo-consistency is judged.");
}

}  // namespace
}  // namespace polyhull::test
