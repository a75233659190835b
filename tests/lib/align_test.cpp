// SPDX-License-Identifier: LGPL-2.1-or-later
// Pictures that disagree are moved onto each other, those that agree stay.
#include "texture/align/align.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "backend.h"
#include "mesh/texture_mesh.h"
#include "shot.h"

namespace polyhull {
namespace {

using synthetic::floor_scene;
using synthetic::point_lamp;
using synthetic::Shot;

/// Where the ray through a pinhole pixel meets the plane z = 0.
Vec3 on_wall(const Camera& camera, const Vec2& ideal) {
  const Vec3 way = camera.ray(ideal);
  const Vec3 eye = camera.centre();
  return eye - way * (eye.z / way.z);
}

/// Print without directions or repeats, codes.
Vec3f print(const Vec3& p) {
  const double a = std::sin(21.0 * p.x + 9.0 * p.y) + 0.7 * std::sin(61.0 * p.y - 33.0 * p.x) +
                   0.4 * std::sin(97.0 * p.x + 41.0 * p.y + 2.0);
  const double b = std::sin(23.0 * p.y + 3.0) + 0.7 * std::sin(57.0 * p.x + 31.0 * p.y + 1.0) +
                   0.4 * std::sin(103.0 * p.y - 29.0 * p.x);
  return {static_cast<float>(128.0 + 45.0 * a), static_cast<float>(128.0 + 45.0 * b),
          static_cast<float>(128.0 - 25.0 * (a + b))};
}

/// A printed wall before \p count cameras side by side; every second picture is moved by \p shift
/// pinhole pixels.
class Wall {
 public:
  explicit Wall(const Vec2& shift, const std::vector<double>& lens = {}, int count = 2)
      : shift_(shift) {
    std::vector<Camera> cameras;
    for (int k = 0; k < count; ++k) {
      const double side = -0.5 + 1.0 * k / (count - 1);
      cameras.push_back(synthetic::look_at({side, 1, 2.5}, {0, 1, 0}, 320, 320, 40.0));
      cameras.back().name = "cam" + std::to_string(k);
      cameras.back().distortion = lens;
    }
    Hull wall;
    synthetic::add_box(wall, {-0.6f, 0.4f, -0.3f}, {0.6f, 1.6f, 0.0f});
    photographed_ = synthetic::photographed(wall, cameras);
    for (std::size_t k = 0; k < cameras.size(); ++k) {
      Picture& picture = photographed_.pictures[k];
      for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x) {
          const Vec2 moved = k % 2 == 1 ? shift : Vec2(0.0);
          const Vec3f c = print(on_wall(cameras[k], cameras[k].undistort({x, y}) - moved));
          for (int i = 0; i < 3; ++i)
            picture.row(y)[4 * x + i] =
                static_cast<std::uint8_t>(std::lround(std::clamp(c[i], 0.0f, 255.0f)));
        }
    }
  }
  Mesh& mesh() { return photographed_.mesh; }
  const Camera& camera(int k) { return mesh().views[static_cast<std::size_t>(k)].calibration; }
  const Texturing& texture(TextureAlign align, int threads = 0) {
    TextureSettings settings;
    settings.metric = TextureMetric::viewing_angle;
    settings.align = align;
    settings.threads = threads;
    texture_mesh(mesh(), settings);
    return *mesh().texturing;
  }
  /// Takes a disk out of the first picture's matte and gives it a colour.
  void cut_hole(std::uint8_t code) {
    Picture& picture = photographed_.pictures[0];
    for (int y = 0; y < picture.height; ++y)
      for (int x = 0; x < picture.width; ++x)
        if (std::hypot(x - 160.0, y - 160.0) < 12.0) {
          std::uint8_t* pixel = picture.row(y) + 4 * x;
          std::fill_n(pixel, 3, code);
          pixel[3] = 0;
        }
  }
  /// What the flow from \p view must be at its pinhole pixel.
  Vec2 expected(int view, const Vec2& pixel) {
    if (view == 1) return shift_;
    const Vec2 there = camera(1).project_ideal(on_wall(camera(0), pixel)).value();
    return camera(0).project_ideal(on_wall(camera(1), there - shift_)).value() - pixel;
  }

 private:
  synthetic::Photographed photographed_;
  Vec2 shift_;
};

/// Calls visit(pixel, offset in pixels) at the flow's texels on the wall, away from its edge.
template <typename Visit>
void each_on_wall(Wall& wall, const PictureFlow& flow, const Visit& visit) {
  const OcclusionMap& map = wall.mesh().texturing->maps[static_cast<std::size_t>(flow.view)];
  for (int y = 0; y < flow.height; ++y)
    for (int x = 0; x < flow.width; ++x) {
      const Vec2 pixel =
          Vec2(map.x, map.y) + static_cast<double>(PictureFlow::coarser * map.step) * Vec2(x, y);
      const Vec3 p = on_wall(wall.camera(flow.view), pixel);
      if (std::abs(p.x) > 0.35 || std::abs(p.y - 1.0) > 0.35) continue;
      const std::int8_t* of = &flow.offsets[2 * static_cast<std::size_t>(y * flow.width + x)];
      visit(pixel, static_cast<double>(PictureFlow::unit * map.step) * Vec2(of[0], of[1]));
    }
}

TEST(AlignTest, TheShiftIsFound) {
  for (const Vec2& shift : {Vec2(3.0, -2.0), Vec2(-1.0, 1.5), Vec2(0.6, 0.0), Vec2(4.5, 0.0)}) {
    const bool lens = shift.x == 3.0;
    Wall wall(shift, lens ? std::vector<double>{0.2, -0.3, 0.01, -0.01} : std::vector<double>{});
    const std::vector<PictureFlow> flows = wall.texture(TextureAlign::flow).flows;
    ASSERT_EQ(flows.size(), 2u);
    for (const PictureFlow& flow : flows) {
      EXPECT_EQ(flow.other, 1 - flow.view);
      double worst = 0.0, sum = 0.0;
      int count = 0;
      each_on_wall(wall, flow, [&](const Vec2& pixel, const Vec2& found) {
        const double off = glm::distance(found, wall.expected(flow.view, pixel));
        worst = std::max(worst, off);
        sum += off;
        ++count;
      });
      ASSERT_GT(count, 300);
      EXPECT_LT(sum / count, 0.1) << shift.x << " " << shift.y << " of view " << flow.view;
      EXPECT_LT(worst, 0.3) << shift.x << " " << shift.y << " of view " << flow.view;
    }
  }
}

TEST(AlignTest, PicturesThatAgreeStay) {
  Wall wall({0.0, 0.0});
  for (const PictureFlow& flow : wall.texture(TextureAlign::flow).flows) {
    double worst = 0.0;
    each_on_wall(wall, flow, [&](const Vec2&, const Vec2& found) {
      worst = std::max(worst, glm::length(found));
    });
    EXPECT_LT(worst, 0.1) << flow.view;
  }
  EXPECT_TRUE(wall.texture(TextureAlign::off).flows.empty());
}

TEST(AlignTest, WhatTheMatteLeavesOutDoesNotCount) {
  Wall wall({3.0, -2.0}), other({3.0, -2.0});
  wall.cut_hole(0);
  other.cut_hole(255);
  EXPECT_EQ(wall.texture(TextureAlign::flow).flows, other.texture(TextureAlign::flow).flows);
}

// Nothing is moved at the wall's edge, whatever the flow before it.
TEST(AlignTest, OutlinesStay) {
  Wall wall({5.0, 3.0});
  for (const PictureFlow& flow : wall.texture(TextureAlign::flow).flows) {
    const OcclusionMap& map = wall.mesh().texturing->maps[static_cast<std::size_t>(flow.view)];
    for (int y = 0; y < flow.height; ++y)
      for (int x = 0; x < flow.width; ++x) {
        if (x > 0 && y > 0 && x < flow.width - 1 && y < flow.height - 1) continue;
        const auto texel = static_cast<std::size_t>(y * flow.width + x);
        EXPECT_EQ(flow.offsets[2 * texel], 0);
        EXPECT_EQ(flow.offsets[2 * texel + 1], 0);
      }
    EXPECT_EQ(flow.width, (map.width + 1) / 2);
  }
}

TEST(AlignTest, ThreadsChangeNothing) {
  Wall wall({3.0, -2.0});
  const std::vector<PictureFlow> one = wall.texture(TextureAlign::flow, 1).flows;
  for (const int threads : {2, 4}) EXPECT_EQ(wall.texture(TextureAlign::flow, threads).flows, one);
}

TEST(AlignTest, DirectAndUnoccludedTexturesHaveNone) {
  Wall wall({3.0, -2.0});
  TextureSettings settings{.metric = TextureMetric::camera_normal};
  settings.align = TextureAlign::flow;
  settings.method = TextureMethod::direct;
  texture_mesh(wall.mesh(), settings);
  EXPECT_TRUE(wall.mesh().texturing->flows.empty());
  settings.method = TextureMethod::blend;
  settings.occlusion = false;
  texture_mesh(wall.mesh(), settings);
  EXPECT_TRUE(wall.mesh().texturing->flows.empty());
}

using AlignedPictureTest = testing::BackendTest;

std::vector<std::uint8_t> drawn(Wall& wall, const Camera& camera) {
  Light lamp = point_lamp({0, 3, 0}, Vec3f(1.0f));
  Shot shot(floor_scene({}, lamp), wall.mesh(), camera);
  shot.draw(0.0f);
  std::vector<std::uint8_t> out;
  for (double y = 0.65; y <= 1.35; y += 0.005)
    for (double x = -0.35; x <= 0.35; x += 0.005) {
      const std::uint8_t* pixel = shot.pixel({x, y, 0});
      out.insert(out.end(), pixel, pixel + 3);
    }
  return out;
}

/// The mean square difference from the print moved by \p shift pixels of \p camera.
double error(const std::vector<std::uint8_t>& picture, const Camera& camera, const Vec2& shift) {
  double sum = 0.0;
  std::size_t i = 0;
  for (double y = 0.65; y <= 1.35; y += 0.005)
    for (double x = -0.35; x <= 0.35; x += 0.005, i += 3) {
      const Vec2 pixel = glm::round(camera.project_ideal({x, y, 0}).value());
      const Vec3f expected = print(on_wall(camera, pixel - shift));
      for (int c = 0; c < 3; ++c) {
        const double off = picture[i + static_cast<std::size_t>(c)] - expected[c];
        sum += off * off;
      }
    }
  return sum / static_cast<double>(i);
}

// Between the cameras what both show stands half way between its two places, once; at the first
// camera's place it stands where that camera shows it. Of six cameras, more than four may colour a
// triangle.
TEST_P(AlignedPictureTest, PrintsAreThereOnce) {
  for (const int count : {2, 6}) {
    Wall wall({4.0, -3.0}, {}, count);
    const Camera middle = synthetic::look_at({0, 1, 2.5}, {0, 1, 0}, 320, 320, 40.0);
    const Camera first = wall.camera(0);
    wall.texture(TextureAlign::off);
    const double off = error(drawn(wall, middle), middle, {2.0, -1.5});
    const double own_off = error(drawn(wall, first), first, {0.0, 0.0});
    wall.texture(TextureAlign::flow);
    const double flow = error(drawn(wall, middle), middle, {2.0, -1.5});
    const double own_flow = error(drawn(wall, first), first, {0.0, 0.0});
    EXPECT_LT(10.0 * std::log10(flow / off), -10.0) << count << ": " << off << " " << flow;
    EXPECT_LT(10.0 * std::log10(own_flow / own_off), -10.0)
        << count << ": " << own_off << " " << own_flow;
  }
}

TEST_P(AlignedPictureTest, FlowsOfNothingChangeNoByte) {
  Wall wall({4.0, -3.0});
  const Camera middle = synthetic::look_at({0.1, 1, 2.5}, {0, 1, 0}, 320, 320, 40.0);
  wall.texture(TextureAlign::flow);
  for (PictureFlow& flow : wall.mesh().texturing->flows)
    flow.offsets.assign(flow.offsets.size(), 0);
  const std::vector<std::uint8_t> nothing = drawn(wall, middle);
  wall.texture(TextureAlign::off);
  EXPECT_EQ(drawn(wall, middle), nothing);
}

INSTANTIATE_TEST_SUITE_P(Backends, AlignedPictureTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
