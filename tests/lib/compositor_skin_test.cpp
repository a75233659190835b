// SPDX-License-Identifier: LGPL-2.1-or-later
// What the subject's own pixels must be: the cameras' pictures, through their lenses, blended.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "backend.h"
#include "shot.h"
#include "texture/texture_hull.h"

namespace polyhull {
namespace {

using synthetic::floor_scene;
using synthetic::point_lamp;
using synthetic::Shot;

using CompositorSkinTest = testing::BackendTest;

/// A wall of 1.2 m before \p cameras, photographed by them, coloured by paint().
struct PaintedWall {
  synthetic::Photographed photographed;
  explicit PaintedWall(const std::vector<Camera>& cameras) {
    Hull wall;
    synthetic::add_box(wall, {-0.6f, 0.4f, -0.04f}, {0.6f, 1.6f, 0.0f});
    photographed = synthetic::photographed(wall, cameras);
    photographed.mesh.texturing =
        texture_hull(wall, cameras, {.metric = TextureMetric::camera_normal});
  }
  /// The first view's picture becomes red, the second's green.
  void show_views_as_primaries() {
    for (std::size_t k = 0; k < 2; ++k)
      for (std::size_t i = 0; i < photographed.pictures[k].pixels.size(); ++i)
        photographed.pictures[k].pixels[i] = i % 4 == 3 || i % 4 == k ? 255 : 0;
  }
};

// Seen from the camera's own place without its lens, the wall has its colours where they belong.
TEST_P(CompositorSkinTest, EveryTermOfTheLensIsUndone) {
  Camera camera = synthetic::look_at({0, 1, 1.5}, {0, 1, 0}, 320, 320, 80.0);
  camera.K[1][0] = 3.0;
  camera.K[1][1] *= 1.02;
  camera.name = "cam0";
  static std::map<std::vector<double>, PaintedWall> walls;  // for both interfaces
  const std::vector<std::vector<double>> lenses = {
      {}, {0.1, -0.6, 0.03, -0.02, 1.0, 0.2, -0.3, 0.5, 0.05, -0.08, -0.04, 0.06}};
  for (const std::vector<double>& lens : lenses) {
    camera.distortion = lens;
    const PaintedWall& wall = walls.try_emplace(lens, std::vector<Camera>{camera}).first->second;
    Light lamp = point_lamp({0, 3, 0}, Vec3f(1.0f));
    Shot shot(floor_scene({}, lamp), wall.photographed.mesh,
              synthetic::look_at({0, 1, 1.5}, {0, 1, 0}, 256, 256, 50.0));
    shot.draw(0.0f);
    double sum = 0.0, worst = 0.0;
    int count = 0;
    for (double y = 0.5; y <= 1.5; y += 0.02) {
      for (double x = -0.5; x <= 0.5; x += 0.02) {
        const Vec2 pixel = glm::round(shot.frame.viewport.project_ideal({x, y, 0}).value());
        const Vec3 way = shot.frame.viewport.ray(pixel);
        const Vec3f expected = synthetic::paint(Vec3(0, 1, 1.5) - way * (1.5 / way.z));
        const std::uint8_t* found = shot.pixel({x, y, 0});
        for (int c = 0; c < 3; ++c) {
          const double error = std::abs(found[c] - 255.0 * expected[c]);
          sum += error;
          worst = std::max(worst, error);
          ++count;
        }
      }
    }
    EXPECT_LT(sum / count, 0.8) << lens.size() << " coefficients";
    EXPECT_LT(worst, 4.0) << lens.size() << " coefficients";
  }
}

// A view's linear colours are multiplied by its camera's matrix and its gain, near by and where smaller
// pictures are drawn.
TEST_P(CompositorSkinTest, MatricesAndGainsMultiplyLight) {
  Camera camera = synthetic::look_at({0, 1, 1.5}, {0, 1, 0}, 320, 320, 80.0);
  camera.name = "cam0";
  static PaintedWall wall({camera});  // for all interfaces
  const Vec3f gain(0.5f, 1.25f, 0.8f);
  const Mat3 colour = from_rows({0.9, 0.2, -0.1, -0.05, 1.1, 0.1, 0.15, -0.3, 1.3});
  for (const double distance : {1.5, 9.0}) {
    Shot shot(floor_scene({}, point_lamp({0, 3, 0}, Vec3f(1.0f))), wall.photographed.mesh,
              synthetic::look_at({0, 1, distance}, {0, 1, 0}, 256, 256, 60.0));
    const std::vector<Vec3> places{{-0.45, 0.6, 0}, {0.4, 0.7, 0}, {0.1, 1.1, 0}, {0.3, 1.4, 0}};
    std::vector<Vec3f> before;
    wall.photographed.mesh.texturing->gains.clear();
    wall.photographed.mesh.views[0].calibration.colour = Mat3(1.0);
    shot.draw(0.0f);
    for (const Vec3& place : places) before.push_back(shot.at(place));
    for (const Mat3& matrix : {Mat3(1.0), colour}) {
      wall.photographed.mesh.texturing->gains = {gain};
      wall.photographed.mesh.views[0].calibration.colour = matrix;
      shot.draw(0.0f);
      for (std::size_t i = 0; i < places.size(); ++i) {
        const Vec3f expected = glm::clamp(gain * (Mat3f(matrix) * before[i]), 0.0f, 1.0f);
        for (int c = 0; c < 3; ++c)
          EXPECT_NEAR(shot.at(places[i])[c], expected[c], 0.015f)
              << distance << " m, place " << i << ", channel " << c;
      }
    }
  }
}

/// A ball before four cameras whose pictures are red, green, blue and grey, each one unit of light.
struct FourColours {
  synthetic::Photographed photographed;
  explicit FourColours(const TextureSettings& settings) {
    Hull ball;
    synthetic::add_ellipsoid(ball, {0, 1, 0}, {0.4f, 0.4f, 0.4f}, 24);
    std::vector<Camera> cameras;
    for (const Vec2& place : {Vec2(-1, 1.6), Vec2(1, 1.8), Vec2(-0.8, 0.2), Vec2(0.9, 0.3)}) {
      cameras.push_back(synthetic::look_at({place.x, place.y, 2.4}, {0, 1, 0}, 128, 128, 40.0));
      cameras.back().name = "cam" + std::to_string(cameras.size());
    }
    photographed = synthetic::photographed(ball, cameras);
    const auto third =
        static_cast<std::uint8_t>(std::lround(255.0f * synthetic::to_srgb(1.0f / 3)));
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t i = 0; i < photographed.pictures[k].pixels.size(); ++i)
        photographed.pictures[k].pixels[i] = i % 4 == 3   ? 255
                                             : k == 3     ? third
                                             : i % 4 == k ? 255
                                                          : 0;
    photographed.mesh.texturing = texture_hull(ball, cameras, settings);
  }
};

// Weights are shares: whatever is blended, one unit of light comes out; and of `cameras` views, at
// most that many show, but for a thousandth.
TEST_P(CompositorSkinTest, BlendedViewsKeepTheirLight) {
  for (const TextureMetric metric : {TextureMetric::camera_normal, TextureMetric::viewing_angle}) {
    for (const std::uint32_t cameras : {1u, 2u, 3u, 4u}) {
      TextureSettings settings;
      settings.cameras = cameras;
      settings.metric = metric;
      const FourColours ball(settings);
      Shot shot(floor_scene({}, point_lamp({0, 3, 0}, Vec3f(1.0f))), ball.photographed.mesh,
                synthetic::look_at({0.1, 1.0, 3.0}, {0, 1, 0}, 160, 160, 20.0));
      shot.settings.shadow = ShadowQuality::off;
      shot.draw(0.0f);
      int pixels = 0, blends = 0, too_many = 0;
      float jump = 0.0f;
      for (double y = 0.8; y <= 1.2; y += 0.01) {
        Vec3f last(-1.0f);
        for (double x = -0.2; x <= 0.2; x += 0.01) {
          const Vec3f c = shot.at({x, y, 0.35});
          EXPECT_NEAR(c.x + c.y + c.z, 1.0f, 0.025f) << cameras << " cameras, " << x << " " << y;
          const float grey = 3.0f * std::min({c.x, c.y, c.z});
          const Vec3f pure = c - Vec3f(grey / 3.0f);
          const int shown = (pure.x > 0.03f) + (pure.y > 0.03f) + (pure.z > 0.03f) + (grey > 0.03f);
          ++pixels;
          blends += shown > 1;
          too_many += shown > static_cast<int>(cameras);
          if (last.x >= 0.0f) jump = std::max(jump, glm::length(c - last));
          last = c;
        }
      }
      // Where the best two are as good as each other, the others' thousandth shows.
      EXPECT_LE(too_many, cameras == 1 ? pixels / 3 : pixels / 50) << cameras;
      if (cameras > 1) {
        EXPECT_GT(blends, pixels / 2) << cameras;
      }
      // Where all four may show, nothing enters or leaves.
      if (cameras == 4) {
        EXPECT_LT(jump, 0.1f);
      }
    }
  }
}

// Drawn smaller than it was seen, what is too fine for the picture shows as its mean, as sixteen
// samples to a pixel have it.
TEST_P(CompositorSkinTest, SmallSubjectsAreNotAliased) {
  const Camera camera = synthetic::look_at({0.1, 1.05, 1.5}, {0, 1, 0}, 320, 240, 60.0);
  PaintedWall wall({camera});
  std::vector<std::uint8_t>& pixels = wall.photographed.pictures[0].pixels;
  const Rectangle& roi = wall.photographed.mesh.views[0].view.roi;
  for (std::size_t i = 0; i < pixels.size() / 4; ++i) {
    const auto x = static_cast<int>(i % static_cast<std::size_t>(roi.width));
    const auto y = static_cast<int>(i / static_cast<std::size_t>(roi.width));
    const bool light = (x / 3 + y / 3) % 2 == 0;  // squares of three pixels
    for (std::size_t c = 0; c < 3; ++c)
      pixels[4 * i + c] = light ? (y < roi.height / 2 ? 240 : 120) : (c == 0 ? 90 : 10);
  }
  const struct {
    double away, bound;  // times as far as the camera; levels
  } cases[] = {{2.0, 18.0}, {3.3, 13.0}, {5.0, 8.0}};
  for (const auto& [away, bound] : cases) {
    Camera viewport = synthetic::look_at(Vec3(0.1, 1.05, 1.5) * away + Vec3(0, 1, 0) * (1 - away),
                                         {0, 1, 0}, 320, 240, 60.0);
    const auto draw = [&](int size) {
      Shot shot(floor_scene({}, point_lamp({0, 3, 0}, Vec3f(1.0f))), wall.photographed.mesh,
                viewport);
      shot.frame.width *= size;
      shot.frame.height *= size;
      shot.settings.shadow = ShadowQuality::off;
      shot.settings.mirror = MirrorMode::off;
      shot.draw(0.0f);
      return shot;
    };
    const Shot coarse = draw(1);
    constexpr int size = 8;  // the reference's pixels are smaller than the camera's
    const Shot fine = draw(size);
    double squares = 0.0;
    int count = 0;
    for (double y = 0.5; y <= 1.5; y += 0.02) {
      for (double x = -0.5; x <= 0.5; x += 0.02) {
        const Vec2 at = glm::round(viewport.project_ideal({x, y, 0}).value());
        const auto px = static_cast<int>(at.x), py = static_cast<int>(at.y);
        const std::uint8_t* found =
            &coarse.picture.pixels[4 * (static_cast<std::size_t>(py) * 320 + px)];
        for (int c = 0; c < 3; ++c) {
          double mean = 0.0;
          for (int j = 0; j < size; ++j)
            for (int i = 0; i < size; ++i)
              mean += synthetic::to_linear(
                  fine.picture.pixels[4 * (static_cast<std::size_t>(py * size + j) * 320 * size +
                                           static_cast<std::size_t>(px * size + i)) +
                                      static_cast<std::size_t>(c)] /
                  255.0f);
          const double error =
              found[c] - 255.0 * synthetic::to_srgb(static_cast<float>(mean / (size * size)));
          squares += error * error;
          ++count;
        }
      }
    }
    const double rms = std::sqrt(squares / count);
    std::printf("%.1f times as far: RMS %.2f levels\n", away, rms);
    EXPECT_LT(rms, bound) << away;
  }
}

// From the camera's own place each pixel is the picture's, whatever the next one is.
TEST_P(CompositorSkinTest, PixelsAreThePicturesOwn) {
  const Camera camera = synthetic::look_at({0.1, 1.05, 1.5}, {0, 1, 0}, 160, 120, 60.0);
  PaintedWall wall({camera});
  std::mt19937 random(5);
  std::vector<std::uint8_t>& pixels = wall.photographed.pictures[0].pixels;
  for (std::size_t i = 0; i < pixels.size(); ++i)
    if (i % 4 < 3) pixels[i] = static_cast<std::uint8_t>(random());
  Shot shot(floor_scene({}, point_lamp({0, 3, 0}, Vec3f(1.0f))), wall.photographed.mesh, camera);
  shot.settings.shadow = ShadowQuality::off;
  shot.draw(0.0f);
  double sum = 0.0;
  int count = 0;
  for (int y = 20; y < 100; ++y)
    for (int x = 40; x < 120; ++x)
      for (int c = 0; c < 3; ++c, ++count)
        sum += std::abs(shot.picture.row(y)[4 * x + c] -
                        wall.photographed.pictures[0].row(y)[4 * x + c]);
  EXPECT_LT(sum / count, 1.0);
}

// Beyond the rim of what a camera sees it hardly counts where another one sees well.
TEST_P(CompositorSkinTest, ARimYieldsToABetterView) {
  std::vector<Camera> cameras;
  cameras.push_back(synthetic::look_at({1, 1, 8}, {-1.05, 1, 0}, 128, 128, 15.0));  // up to x = 0
  cameras.push_back(synthetic::look_at({-1, 1, 8}, {0, 1, 0}, 128, 128, 15.0));
  for (std::size_t k = 0; k < 2; ++k) cameras[k].name = "cam" + std::to_string(k);
  PaintedWall wall(cameras);
  wall.show_views_as_primaries();
  Shot shot(floor_scene({}, point_lamp({0, 3, 0}, Vec3f(1.0f))), wall.photographed.mesh,
            synthetic::look_at({0, 1, 4}, {0, 1, 0}, 160, 120, 20.0));
  shot.settings.shadow = ShadowQuality::off;
  shot.draw(0.0f);
  for (const double x : {0.1, 0.2, 0.4}) {
    EXPECT_LT(shot.at({x, 1, 0}).x, 0.002) << x;
    EXPECT_NEAR(shot.at({x, 1, 0}).y, 1.0, 0.002) << x;
  }
  EXPECT_GT(shot.at({-0.4, 1, 0}).x, 0.1);  // both see it
}

// Two views of a wall share by the squares of their weights.
TEST_P(CompositorSkinTest, TheBetterViewPrevailsBySquares) {
  std::vector<Camera> cameras;
  for (const double x : {1.0, -6.0}) {
    cameras.push_back(synthetic::look_at({x, 1, 8}, {0, 1, 0}, 128, 128, 15.0));
    cameras.back().name = "cam" + std::to_string(cameras.size());
  }
  PaintedWall wall(cameras);
  wall.show_views_as_primaries();
  Shot shot(floor_scene({}, point_lamp({0, 3, 0}, Vec3f(1.0f))), wall.photographed.mesh,
            synthetic::look_at({0, 1, 4}, {0, 1, 0}, 160, 120, 20.0));
  shot.settings.shadow = ShadowQuality::off;
  shot.draw(0.0f);
  // The weights of the front's corners; they hardly differ.
  const Hull& hull = wall.photographed.mesh.hull;
  double weights[2] = {0, 0};
  for (std::size_t v = 0; v < hull.vertices.size(); ++v)
    if (hull.vertices[v].z == 0.0f)
      for (std::size_t k = 0; k < 2; ++k)
        weights[k] += wall.photographed.mesh.texturing->weights[2 * v + k] / 4;
  EXPECT_GT(weights[0], 1.1 * weights[1]);
  const double share =
      weights[0] * weights[0] / (weights[0] * weights[0] + weights[1] * weights[1]);
  EXPECT_NEAR(shot.at({0, 1, 0}).x, share, 0.03);
  EXPECT_NEAR(shot.at({0, 1, 0}).y, 1 - share, 0.03);
}

// Each triangle shows the one view that is best for it.
TEST_P(CompositorSkinTest, DirectShowsOneViewPerTriangle) {
  TextureSettings settings{.metric = TextureMetric::camera_normal};
  settings.method = TextureMethod::direct;
  const FourColours ball(settings);
  Shot shot(floor_scene({}, point_lamp({0, 3, 0}, Vec3f(1.0f))), ball.photographed.mesh,
            synthetic::look_at({0, 1.0, 3.0}, {0, 1, 0}, 160, 160, 20.0));
  shot.settings.shadow = ShadowQuality::off;
  shot.draw(0.0f);
  // Towards each camera its own colour.
  EXPECT_NEAR(shot.at({-0.2, 1.15, 0.3}).x, 1.0f, 0.01f);
  EXPECT_NEAR(shot.at({0.2, 1.15, 0.3}).y, 1.0f, 0.01f);
  EXPECT_NEAR(shot.at({-0.2, 0.85, 0.3}).z, 1.0f, 0.01f);
  const Vec3f grey = shot.at({0.2, 0.85, 0.3});
  EXPECT_LT(glm::length(grey - Vec3f(1.0f / 3)), 0.02f);
}

// What no view sees has its vertices' fill colours, between them blended as light; what one sees
// keeps its own colours.
TEST_P(CompositorSkinTest, WhatNoViewSeesIsFilled) {
  PaintedWall wall({synthetic::look_at({0, 1, 2}, {0, 1, 0}, 320, 320, 60.0)});
  Mesh& mesh = wall.photographed.mesh;
  for (const Vec3f& v : mesh.hull.vertices)
    mesh.texturing->fill.push_back(v.x < 0.0f ? 0xff0000c8u : 0xff00c800u);  // red, green
  for (std::uint8_t& value : wall.photographed.pictures[0].pixels) value = 255;
  const auto shot_from = [&](double z) {
    Shot shot(floor_scene({}, point_lamp({0, 3, 0}, Vec3f(1.0f))), mesh,
              synthetic::look_at({0, 1, z}, {0, 1, 0}, 256, 256, 50.0));
    shot.settings.shadow = ShadowQuality::off;
    shot.draw(0.0f);
    return shot;
  };
  const Shot front = shot_from(1.5), back = shot_from(-1.5);
  const float full = synthetic::to_linear(200.0f / 255.0f);
  for (double x = -0.5; x <= 0.5; x += 0.05) {
    for (double y = 0.6; y <= 1.4; y += 0.1) {
      EXPECT_GT(front.at({x, y, 0}).z, 0.98f) << x << " " << y;
      const auto share = static_cast<float>((0.6 + x) / 1.2);
      const Vec3f c = back.at({x, y, -0.04});
      EXPECT_NEAR(c.x, full * (1.0f - share), 0.012f) << x << " " << y;
      EXPECT_NEAR(c.y, full * share, 0.012f) << x << " " << y;
      EXPECT_LT(c.z, 0.001f);
    }
  }
}

// A mesh straight from hullbuild or hullrefine, and one whose views have no pictures (masks), shows
// its form: as bright as it faces the eye, by its own normals or its faces'.
TEST_P(CompositorSkinTest, WithoutPicturesTheFormIsShaded) {
  TextureSettings grey;
  grey.untextured = Vec3f(0.5f);
  FourColours ball{grey};
  Mesh& mesh = ball.photographed.mesh;
  const Vec3 eye(0, 1, 3);
  for (const bool smooth : {false, true}) {
    mesh.hull.normals.clear();
    for (const Vec3f& v : mesh.hull.vertices)
      if (smooth)
        mesh.hull.normals.push_back(glm::normalize(Vec3(v) + mesh.hull.origin - Vec3(0, 1, 0)));
    for (const bool masks : {false, true}) {
      Mesh plain = mesh;
      if (masks)
        for (MeshView& view : plain.views) view.view.format = PixelFormat::grey;
      else
        plain.texturing.reset();
      Shot shot(floor_scene({}, point_lamp({0, 3, 0}, Vec3f(1.0f))), plain,
                synthetic::look_at(eye, {0, 1, 0}, 160, 160, 20.0));
      shot.settings.shadow = ShadowQuality::off;
      shot.draw(0.0f);
      for (const double turn : {-55.0, -30.0, 0.0, 20.0, 45.0}) {
        const Vec3 normal(std::sin(glm::radians(turn)), 0.0, std::cos(glm::radians(turn)));
        const Vec3 place = Vec3(0, 1, 0) + 0.395 * normal;
        const auto facing = static_cast<float>(glm::dot(normal, glm::normalize(eye - place)));
        const float expected = synthetic::to_linear(0.5f) * (0.25f + 0.75f * facing);
        EXPECT_NEAR(shot.at(place).y, expected, smooth ? 0.006f : 0.025f)
            << turn << " degrees, " << (masks ? "masks" : "no texturing");
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Api, CompositorSkinTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
