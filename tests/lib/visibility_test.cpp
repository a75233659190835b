// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/visibility.h"

#include <gtest/gtest.h>

#include <cmath>

#include "seen_truth.h"
#include "studio_mesh.h"
#include "synthetic.h"
#include "texture/texture_hull.h"

namespace polyhull {
namespace {

std::vector<Sight> look(const Hull& hull, std::span<const Camera> cameras,
                        const SightSettings& settings = {}) {
  std::vector<Sight> sights(cameras.size());
  const MeshFaces faces = find_faces(hull, 0);
  Seer seer;
  for (std::size_t k = 0; k < cameras.size(); ++k)
    seer.look(hull, faces, cameras[k], static_cast<int>(k), settings, sights[k]);
  return sights;
}

/// A body with a head and arms before it, which touch nowhere: the figure's parts cross.
Hull parts(int stacks) {
  Hull hull;
  synthetic::add_ellipsoid(hull, {0.0f, 0.9f, 0.0f}, {0.28f, 0.8f, 0.2f}, stacks);
  synthetic::add_ellipsoid(hull, {0.0f, 1.95f, 0.0f}, {0.14f, 0.17f, 0.15f}, stacks);
  synthetic::add_ellipsoid(hull, {-0.38f, 1.2f, 0.32f}, {0.08f, 0.08f, 0.35f}, stacks);
  synthetic::add_ellipsoid(hull, {0.38f, 1.2f, 0.32f}, {0.08f, 0.08f, 0.35f}, stacks);
  return hull;
}

/// As test::agreement, of what Seer finds, in percent.
double agreed(const Hull& hull, std::span<const Camera> cameras,
              const SightSettings& settings = {}) {
  const std::vector<Sight> sights = look(hull, cameras, settings);
  const double out =
      100.0 * test::agreement(hull, cameras.size(), test::seen_by_rays(hull, cameras),
                              [&](std::size_t k, std::size_t f) { return sights[k].share[f]; });
  std::printf("judged right: %.3f %% of the visible area\n", out);
  return out;
}

TEST(Visibility, OfADenseBodyAgreesWithRays) {
  const Hull body = test::dense_body();
  ASSERT_GT(body.triangles.size() / 3, 34000u);
  EXPECT_GT(agreed(body, test::ring_rig(4).cameras), 99.9);
}

TEST(Visibility, OfAHullAgreesWithRays) {
  const Rig rig = test::ring_rig(4);
  EXPECT_GT(agreed(test::studio_mesh(rig, "figure", 3.0, {}).mesh.hull, rig.cameras), 99.75);
}

TEST(Visibility, SameBytesOnEveryInstructionSet) {
  const Hull body = test::dense_body();
  const Camera camera = test::ring_rig(5).cameras[1];
  const MeshFaces faces = find_faces(body, 0);
  Sight best, baseline;
  Seer().look(body, faces, camera, 0, {}, best);
  Seer(TextureLoops::baseline()).look(body, faces, camera, 0, {}, baseline);
  EXPECT_EQ(best.share, baseline.share);
  EXPECT_EQ(best.cosine, baseline.cosine);
  EXPECT_EQ(best.sums, baseline.sums);
  EXPECT_EQ(best.map, baseline.map);
  std::vector<float> weights(body.vertices.size()), others(body.vertices.size());
  const Vec3f eye(camera.centre());
  const MeshPoints points{body.vertices.size(), &body.vertices[0].x};
  TextureLoops::best().weigh(points, points.xyz, &eye.x, best.sums.data(), weights.data());
  TextureLoops::baseline().weigh(points, points.xyz, &eye.x, best.sums.data(), others.data());
  EXPECT_EQ(weights, others);
}

TEST(Visibility, SixtyFourCamerasAreTheSameOnAnyNumberOfThreads) {
  const Hull body = test::dense_body();
  const std::vector<Camera> cameras = test::ring_rig(64).cameras;
  TextureSettings settings{.metric = TextureMetric::camera_normal};
  settings.threads = 1;
  HullTexturer texturer;
  const Texturing one = texturer.texture(body, cameras, settings);
  for (const int threads : {2, 3, 8}) {
    settings.threads = threads;
    const Texturing& many = texturer.texture(body, cameras, settings);
    EXPECT_EQ(many.visible, one.visible) << threads;
    EXPECT_EQ(many.best, one.best) << threads;
    EXPECT_EQ(many.weights, one.weights) << threads;
    EXPECT_EQ(many.maps, one.maps) << threads;
  }
  // Of neighbours in the ring each sees about what the other does.
  std::size_t last = 0, both = 0;
  for (const std::uint64_t mask : one.visible) {
    last += mask >> 63;
    both += mask >> 63 & mask;
  }
  EXPECT_GT(both, last * 9 / 10);
}

// The map that goes along may be coarse; what is seen is not.
TEST(Visibility, HardlyDependsOnTheMapsSize) {
  const Hull hull = parts(24);
  const std::vector<Camera> cameras = synthetic::ring(3, 3.5, 1.6, {0, 1, 0});
  for (const int size : {16, 100, 320, 1000}) {
    SightSettings settings;
    settings.map_size = size;
    EXPECT_GT(agreed(hull, cameras, settings), 99.95) << size;
  }
}

// A wall of small triangles, and before it a stick that is thinner than the map's texels.
TEST(Visibility, ThinThingsHideWhatIsBehindThem) {
  Hull hull;
  synthetic::add_ellipsoid(hull, {0, 1, 0}, {0.5f, 0.9f, 0.2f}, 60);
  const std::size_t wall = hull.triangles.size() / 3;
  synthetic::add_box(hull, {0.1f, 0.0f, 0.5f}, {0.102f, 2.0f, 0.502f});
  synthetic::add_box(hull, {-0.5f, 1.1f, 0.5f}, {0.5f, 1.102f, 0.502f});
  const std::vector<Camera> camera{synthetic::look_at({0.3, 1.2, 3.5}, {0, 1, 0}, 640, 480, 50.0)};
  EXPECT_GT(agreed(hull, camera), 99.8);
  const std::vector<Sight> sights = look(hull, camera);
  int partly = 0;
  for (std::size_t f = 0; f < wall; ++f)
    partly += sights[0].share[f] > 0.0f && sights[0].share[f] < 1.0f;
  EXPECT_GT(partly, 60);
}

// Slanted so that each texel lies deeper than the one before: nothing hides.
TEST(Visibility, ASlantedSurfaceDoesNotHideItself) {
  Hull hull;
  const int side = 80;
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(i * (side + 1) + j); };
  for (int i = 0; i <= side; ++i)
    for (int j = 0; j <= side; ++j)
      hull.vertices.emplace_back(0.01f * (i - 40), 0.0f, 0.02f * (j - 40));
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j)
      hull.triangles.insert(hull.triangles.end(), {at(i, j), at(i, j + 1), at(i + 1, j + 1),
                                                   at(i, j), at(i + 1, j + 1), at(i + 1, j)});
  for (const double height : {2.0, 0.5, 0.1, 0.04}) {
    const std::vector<Camera> camera{
        synthetic::look_at({0.2, height, 3.0}, {0, 0, 0}, 1024, 768, 50.0)};
    const std::vector<Sight> sights = look(hull, camera);
    for (const float share : sights[0].share) ASSERT_EQ(share, 1.0f) << height;
  }
}

TEST(Visibility, EndsWhereTheFrameEnds) {
  const Hull hull = parts(24);
  Camera camera = synthetic::look_at({0, 1.0, 2.0}, {0.35, 1.9, 0}, 640, 480, 40.0);
  EXPECT_GT(agreed(hull, std::vector<Camera>{camera}), 99.8);
  camera.distortion = {-0.2, 0.05, 0.001, -0.001};
  EXPECT_GT(agreed(hull, std::vector<Camera>{camera}), 99.8);
}

// The arms reach past the camera, which stands between them.
TEST(Visibility, OfWhatReachesBehindTheCamera) {
  const Hull hull = parts(24);
  const std::vector<Camera> cameras{
      synthetic::look_at({0.05, 1.25, 0.45}, {0, 1.2, 0}, 640, 480, 90.0)};
  EXPECT_GT(agreed(hull, cameras), 99.5);
  Hull box;
  synthetic::add_box(box, {-1, -1, -4}, {1, 0, 4});  // as triangles that reach far behind
  EXPECT_GT(agreed(box, std::vector<Camera>{synthetic::look_at({0.3, 0.5, 2.0}, {0, 0, 0}, 640, 480,
                                                               60.0)}),
            99.5);
}

TEST(Visibility, MeshesFarAwayAndManyTriangles) {
  Hull hull = parts(40);
  const std::vector<Camera> far = synthetic::ring(2, 150.0, 1.6, {0, 1, 0});
  EXPECT_GT(agreed(hull, far), 99.9);
}

/// Weight times fade, which is what colours.
float counts(const Texturing& texturing, const Camera& camera, std::size_t k, std::size_t views,
             std::size_t v, const Vec3f& place) {
  const OcclusionMap& map = texturing.maps[k];
  const Vec2 pixel = camera.project_ideal(Vec3(place)).value();
  const auto x = static_cast<float>(pixel.x - map.x) / map.step;
  const auto y = static_cast<float>(pixel.y - map.y) / map.step;
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  if (i < 0 || j < 0 || i + 1 >= map.width || j + 1 >= map.height) return 0.0f;
  const auto fade = [&](int a, int b) {
    return static_cast<float>(map.fade[static_cast<std::size_t>(b) * map.width + a]) / 255.0f;
  };
  const float s = x - static_cast<float>(i), t = y - static_cast<float>(j);
  return texturing.weights[v * views + k] *
         ((1 - t) * ((1 - s) * fade(i, j) + s * fade(i + 1, j)) +
          t * ((1 - s) * fade(i, j + 1) + s * fade(i + 1, j + 1)));
}

// From a vertex to the next, some 12 mm, what a camera contributes changes little, also where
// something hides the surface and at outlines.
TEST(Visibility, WeightsAreContinuous) {
  const Hull body = test::dense_body();
  const std::vector<Camera> cameras = test::ring_rig(4).cameras;
  const Texturing texturing = texture_hull(body, cameras, {.metric = TextureMetric::camera_normal});
  const std::size_t views = cameras.size();
  std::size_t steps = 0, large = 0;
  float most = 0.0f;
  for (std::size_t f = 0; f < body.triangles.size() / 3; ++f) {
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t a = body.triangles[3 * f + i], b = body.triangles[3 * f + (i + 1) % 3];
      if (a > b) continue;
      for (std::size_t k = 0; k < views; ++k) {
        const float step = std::abs(counts(texturing, cameras[k], k, views, a, body.vertices[a]) -
                                    counts(texturing, cameras[k], k, views, b, body.vertices[b]));
        const double pixels =
            glm::distance(cameras[k].project_ideal(Vec3(body.vertices[a])).value(),
                          cameras[k].project_ideal(Vec3(body.vertices[b])).value());
        const float slope = step / static_cast<float>(1.0 + pixels);
        most = std::max(most, slope);
        large += slope > 0.1f;
        ++steps;
      }
    }
  }
  std::printf("largest step per pixel %.3f, %.4f %% above .1\n", most, 100.0 * large / steps);
  EXPECT_LT(most, 0.35f);
  EXPECT_LT(static_cast<double>(large) / steps, 2e-4);
}

}  // namespace
}  // namespace polyhull
