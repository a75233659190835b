// SPDX-License-Identifier: LGPL-2.1-or-later
// Which cameras colour a fragment: of any number of them the best, and none enters or leaves the
// blend at once, neither over the surface nor on the viewport's way. Each camera's picture is of one
// plain colour, so that the composite shows the weights.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "backend.h"
#include "render/subject/view_weights.h"
#include "shot.h"
#include "texture/texture_hull.h"

namespace polyhull {
namespace {

using synthetic::floor_scene;
using synthetic::point_lamp;

using CompositorCamerasTest = testing::BackendTest;

/// Linear light; neighbours on a ring differ in all three.
Vec3f colour_of_camera(std::size_t k) {
  const auto value = [k](double step) {
    const double x = 0.37 + step * static_cast<double>(k);
    return static_cast<float>(std::lround(255.0 * (x - std::floor(x)))) / 255.0f;
  };
  return {value(0.618), value(0.414), value(0.732)};
}

void paint_plain(synthetic::Photographed& photographed) {
  for (std::size_t k = 0; k < photographed.pictures.size(); ++k) {
    std::vector<std::uint8_t>& pixels = photographed.pictures[k].pixels;
    const Vec3f colour = colour_of_camera(k);
    for (std::size_t i = 0; i < pixels.size(); ++i)
      pixels[i] = i % 4 == 3 ? 255
                             : static_cast<std::uint8_t>(std::lround(
                                   255.0f * synthetic::to_srgb(colour[static_cast<int>(i % 4)])));
  }
}

/// What a byte of a picture can hold of a colour.
Vec3f rounded(const Vec3f& colour) {
  Vec3f out;
  for (int c = 0; c < 3; ++c)
    out[c] = synthetic::to_linear(
        static_cast<float>(std::lround(255.0f * synthetic::to_srgb(colour[c]))) / 255.0f);
  return out;
}

/// A ball of radius 0.4 around (0, 1, 0), seen by cameras of plain colours.
struct PlainBall {
  synthetic::Photographed photographed;
  PlainBall(const std::vector<Camera>& cameras, const TextureSettings& settings, int stacks = 40) {
    Hull ball;
    synthetic::add_ellipsoid(ball, {0, 1, 0}, {0.4f, 0.4f, 0.4f}, stacks);
    photographed = synthetic::photographed(ball, cameras);
    paint_plain(photographed);
    photographed.mesh.texturing = texture_hull(ball, cameras, settings);
  }
};

std::vector<Camera> ring(int count) {
  return synthetic::ring(count, 3.0, 1.0, {0, 1, 0}, 96, 96, 30.0);
}

/// Draws meshes from many places by one renderer.
class Drawer {
 public:
  synthetic::Shot from(const Camera& viewport, const Mesh& mesh) {
    synthetic::Shot shot(floor_scene({}, point_lamp({0, 3, 0}, Vec3f(1.0f))), mesh, viewport);
    shot.frame.scene = scene_;
    shot.settings.shadow = ShadowQuality::off;
    shot.settings.mirror = MirrorMode::off;
    const std::vector<std::uint8_t> black(static_cast<std::size_t>(viewport.width) *
                                          viewport.height * 4);
    shot.picture = Picture{viewport.width, viewport.height, 4, black};
    const int stride = 4 * viewport.width;
    renderer_->render(shot.frame, renderer_->plan(shot.frame, shot.settings), shot.settings,
                      black.data(), stride, shot.picture.pixels.data(), stride);
    return shot;
  }

 private:
  std::unique_ptr<Renderer> renderer_ = testing::BackendTest::make_renderer();
  std::shared_ptr<const Scene> scene_ =
      std::make_shared<const Scene>(floor_scene({}, point_lamp({0, 3, 0}, Vec3f(1.0f))));
};

// Where no camera is as fine as the viewport, the finest loses nothing, and how much finer the viewport is
// does not count.
TEST(ViewWeights, TheFinestOfCoarseCamerasLosesNothing) {
  std::vector<Camera> cameras = ring(6);
  for (std::size_t k = 0; k < cameras.size(); ++k)
    cameras[k].K[0][0] = cameras[k].K[1][1] *= 1.0 - 0.1 * static_cast<double>(k);
  const PlainBall ball(cameras, {.metric = TextureMetric::lumigraph});
  const Mesh& mesh = ball.photographed.mesh;
  const auto weights = [&](double pixel_size) {
    return ViewWeights(mesh, {{0.3, 1.2, 2.0}, pixel_size});
  };
  const ViewWeights coarse = weights(1.0), fine = weights(1e-5), finer = weights(1e-6);
  std::size_t seen = 0;
  for (std::size_t v = 0; v < mesh.hull.vertices.size(); ++v) {
    float kept = 0.0f;  // the largest share of its weight that a view has kept
    for (std::size_t k = 0; k < cameras.size(); ++k) {
      EXPECT_NEAR(fine(v, k), finer(v, k), 1e-4f * coarse(v, k)) << v;
      EXPECT_LE(fine(v, k), 1.0001f * coarse(v, k)) << v;
      if (coarse(v, k) > 0.0f) kept = std::max(kept, fine(v, k) / coarse(v, k));
    }
    if (kept == 0.0f) continue;
    ++seen;
    EXPECT_NEAR(kept, 1.0f, 1e-4f) << v;
  }
  EXPECT_GT(seen, 500u);
}

/// The blend by its definition: the \p best largest weights less the next one.
Vec3f blended(const std::vector<float>& weights, std::size_t best) {
  std::vector<float> sorted = weights;
  std::sort(sorted.begin(), sorted.end(), std::greater<>());
  float off = best < sorted.size() ? sorted[best] : 0.0f;
  off = std::min(off, 0.999f * sorted[0]);
  Vec3f sum(0.0f);
  float total = 0.0f;
  for (std::size_t k = 0; k < weights.size(); ++k) {
    const float w = std::max(weights[k] - off, 0.0f);
    sum += w * rounded(colour_of_camera(k));
    total += w;
  }
  return sum / total;
}

// Any number of cameras, any number of them blended: each point of a ball, of which nothing hides
// anything, has the blend that the definition says.
TEST_P(CompositorCamerasTest, AnyNumberOfThemIsBlended) {
  const Vec3 eye(0.9, 1.5, 2.8);
  Drawer drawer;
  for (const int count : {1, 2, 5, 8, 16, 64}) {
    for (const std::uint32_t best : {1u, 2u, 4u, 6u, 64u}) {
      if (static_cast<int>(best) > count && best != 64u) continue;
      if (count == 64 && best < 4) continue;  // the best change within a triangle
      TextureSettings settings{.metric = TextureMetric::camera_normal};
      settings.occlusion = false;
      settings.cameras = best;
      // Not all of one height: no three of them are alike anywhere but by chance.
      std::vector<Camera> cameras = ring(count);
      for (int k = 0; k < count; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / count;
        cameras[static_cast<std::size_t>(k)] = synthetic::look_at(
            {3.0 * std::sin(angle), 1.3 + 0.9 * std::sin(2.0 * k), 3.0 * std::cos(angle)},
            {0, 1, 0}, 48, 48, 30.0);
      }
      const PlainBall ball(cameras, settings, 24);
      const synthetic::Shot shot =
          drawer.from(synthetic::look_at(eye, {0, 1, 0}, 96, 96, 16.0), ball.photographed.mesh);
      double sum = 0.0;
      int points = 0, far = 0;
      for (double y = -0.25; y <= 0.25; y += 0.05) {
        for (double x = -0.25; x <= 0.25; x += 0.05) {
          // A point of the ball towards the eye.
          const Vec3 to_eye = glm::normalize(eye - Vec3(0, 1, 0));
          const Vec3 right = glm::normalize(glm::cross(Vec3(0, 1, 0), to_eye));
          const Vec3 n =
              glm::normalize(to_eye + 2.0 * x * right + 2.0 * y * glm::cross(to_eye, right));
          const Vec3 p = Vec3(0, 1, 0) + 0.4 * n;
          std::vector<float> weights;
          bool none = true;
          for (const Camera& camera : cameras) {
            const auto cosine =
                static_cast<float>(glm::dot(n, glm::normalize(camera.centre() - p)));
            weights.push_back(cosine > 0.0f ? cosine * cosine : 0.0f);
            none = none && cosine < 0.15f;
          }
          if (none) continue;
          const float off = glm::length(shot.at(p) - blended(weights, best));
          sum += off;
          ++points;
          far += off > 0.1f;  // near where the best change a triangle decides
        }
      }
      ASSERT_GT(points, 60) << count;
      // One alone changes from triangle to triangle.
      EXPECT_LT(sum / points, best == 1 ? 0.05 : 0.015) << count << " cameras, best " << best;
      EXPECT_LE(far, best == 1 ? points / 8 : points / 60) << count << " cameras, best " << best;
    }
  }
}

// Five cameras look straight at a wall, and a post hides a part of it from all five; only the sixth,
// which sees the wall at a steep angle, knows what is there.
TEST_P(CompositorCamerasTest, ABetterOneThatSeesNothingGivesWay) {
  std::vector<Camera> cameras;
  for (int k = 0; k < 5; ++k)
    cameras.push_back(synthetic::look_at({0.05 * (k - 2), 1, 4}, {0, 1, 0}, 192, 192, 30.0));
  cameras.push_back(synthetic::look_at({-3.4, 1, 2}, {0, 1, 0}, 192, 192, 30.0));
  Hull hull;
  synthetic::add_box(hull, {-0.6f, 0.4f, -0.04f}, {0.6f, 1.6f, 0.0f});
  synthetic::add_box(hull, {-0.1f, 0.4f, 0.8f}, {0.1f, 1.6f, 0.84f});
  synthetic::Photographed photographed = synthetic::photographed(hull, cameras);
  paint_plain(photographed);
  TextureSettings settings{.metric = TextureMetric::camera_normal};
  settings.fill = TextureFill::grey;
  photographed.mesh.texturing = texture_hull(hull, cameras, settings);
  const synthetic::Shot shot = Drawer().from(
      synthetic::look_at({-3.0, 1.1, 2.2}, {0, 1, 0}, 160, 120, 24.0), photographed.mesh);
  for (const double y : {0.8, 1.0, 1.2}) {
    const Vec3f c = shot.at({0.0, y, 0});
    EXPECT_LT(glm::length(c - rounded(colour_of_camera(5))), 0.01f) << y;
  }
}

struct Blend {
  TextureMetric metric;
  std::uint32_t cameras;
};

// The eye goes around a ball and looks at one point of it: no step changes its colour more than a
// small turn can. Where a camera stands, the lumigraph shows little but its picture.
TEST_P(CompositorCamerasTest, NothingJumpsOnTheViewportsWay) {
  Drawer drawer;
  for (const int count : {8, 16}) {
    for (const Blend& blend :
         {Blend{TextureMetric::viewing_angle, 2}, Blend{TextureMetric::viewing_angle, 5},
          Blend{TextureMetric::lumigraph, 2}, Blend{TextureMetric::lumigraph, 5}}) {
      TextureSettings settings;
      settings.metric = blend.metric;
      settings.cameras = blend.cameras;
      const PlainBall ball(ring(count), settings);
      const double spacing = 2.0 * std::numbers::pi / count;
      const auto towards = [&](double turn) {
        return Vec3(std::sin(turn * spacing), 0.0, std::cos(turn * spacing));
      };
      const Vec3 point = Vec3(0, 1, 0) + 0.4 * towards(0.5);
      constexpr int steps = 40;  // from one camera to the next
      Vec3f last(-1.0f);
      float jump = 0.0f, way = 0.0f;
      for (int step = -32; step <= steps - 8; ++step) {
        const Vec3 eye = Vec3(0, 1, 0) + 3.0 * towards(static_cast<double>(step) / steps);
        const Vec3f c =
            drawer.from(synthetic::look_at(eye, point, 17, 17, 3.0), ball.photographed.mesh)
                .at(point);
        if (last.x >= 0.0f) {
          jump = std::max(jump, glm::length(c - last));
          way += glm::length(c - last);
        }
        last = c;
        if (count == 8 && blend.metric == TextureMetric::lumigraph && step % steps == 0) {
          EXPECT_LT(glm::length(c - rounded(colour_of_camera(step == 0 ? 0 : 1))), 0.1f);
        }
      }
      EXPECT_GT(way, 0.08f) << count << " cameras, best " << blend.cameras;  // the viewport counts
      EXPECT_LT(jump, 0.05f) << count << " cameras, best " << blend.cameras;
    }
  }
}

// Along the ball's middle no pixel differs from the next by more than the way between them can.
TEST_P(CompositorCamerasTest, NothingJumpsOverTheSurface) {
  Drawer drawer;
  for (const int count : {5, 16, 64}) {
    for (const Blend& blend :
         {Blend{TextureMetric::camera_normal, 2}, Blend{TextureMetric::camera_normal, 5},
          Blend{TextureMetric::viewing_angle, 3}, Blend{TextureMetric::lumigraph, 2},
          Blend{TextureMetric::lumigraph, 5}}) {
      if (count == 64 && blend.cameras < 5) continue;  // steep: the best hardly differ
      TextureSettings settings;
      settings.metric = blend.metric;
      settings.cameras = blend.cameras;
      settings.fade_width = 3.0;
      const PlainBall ball(ring(count), settings);
      const double angle = 1.0 / count;
      const Vec3 eye = Vec3(0, 1.02, 0) + 3.0 * Vec3(std::sin(angle), 0.0, std::cos(angle));
      const synthetic::Shot shot =
          drawer.from(synthetic::look_at(eye, {0, 1.02, 0}, 320, 16, 14.0), ball.photographed.mesh);
      float jump = 0.0f;
      Vec3f last(-1.0f);
      for (int x = 24; x < 296; ++x) {
        const std::uint8_t* p = &shot.picture.row(8)[4 * x];
        const Vec3f c(synthetic::to_linear(p[0] / 255.0f), synthetic::to_linear(p[1] / 255.0f),
                      synthetic::to_linear(p[2] / 255.0f));
        if (last.x >= 0.0f) jump = std::max(jump, glm::length(c - last));
        last = c;
      }
      EXPECT_LT(jump, 0.07f) << count << " cameras, metric " << static_cast<int>(blend.metric)
                             << ", best " << blend.cameras;
    }
  }
}

// A camera of half the focal length counts half where the viewport shows more than it sees, and as
// much as the other where the viewport shows less.
TEST_P(CompositorCamerasTest, ResolutionCountsWhereItIsMissed) {
  std::vector<Camera> cameras;
  for (const double x : {-0.8, 0.8})
    cameras.push_back(synthetic::look_at({x, 1, 3}, {0, 1, 0}, 160, 160, x < 0.0 ? 30.0 : 56.4));
  Hull wall;
  synthetic::add_box(wall, {-0.6f, 0.4f, -0.04f}, {0.6f, 1.6f, 0.0f});
  synthetic::Photographed photographed = synthetic::photographed(wall, cameras);
  paint_plain(photographed);
  TextureSettings settings;
  settings.metric = TextureMetric::lumigraph;
  photographed.mesh.texturing = texture_hull(wall, cameras, settings);
  Drawer drawer;
  const Vec3f first = rounded(colour_of_camera(0)), second = rounded(colour_of_camera(1));
  for (const auto& [pixels, share] : {std::pair{640, 2.0f / 3.0f}, std::pair{40, 0.5f}}) {
    const Vec3f c =
        drawer
            .from(synthetic::look_at({0, 1, 3}, {0, 1, 0}, pixels, pixels, 30.0), photographed.mesh)
            .at({0, 1, 0});
    EXPECT_LT(glm::length(c - (share * first + (1.0f - share) * second)), 0.03f) << pixels;
  }
}

INSTANTIATE_TEST_SUITE_P(Api, CompositorCamerasTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
