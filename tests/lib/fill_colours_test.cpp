// SPDX-License-Identifier: LGPL-2.1-or-later
// What no camera sees takes its colours from what is seen around it, over the surface.
#include "texture/fill_colours.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/picture.h"
#include "base/srgb.h"
#include "mesh/texture_mesh.h"
#include "synthetic.h"

namespace polyhull {
namespace {

Vec3f colour(std::uint32_t rgba) {
  return Vec3f(rgba & 255, rgba >> 8 & 255, rgba >> 16 & 255);
}

/// A hull before cameras whose pictures are painted by their pixels' places.
class Stage {
 public:
  template <typename Paint>
  Stage(const Hull& hull, const std::vector<Camera>& cameras, const Paint& paint)
      : photographed_(synthetic::photographed(hull, cameras)) {
    for (std::size_t k = 0; k < cameras.size(); ++k) {
      Picture& picture = photographed_.pictures[k];
      for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
          const Vec3f c = paint(k, x, y);
          for (int i = 0; i < 3; ++i)
            picture.row(y)[4 * x + i] = static_cast<std::uint8_t>(std::lround(c[i]));
        }
      }
    }
  }
  Mesh& mesh() { return photographed_.mesh; }
  const std::vector<std::uint32_t>& fill(TextureFill how, int threads = 0) {
    TextureSettings settings{.metric = TextureMetric::camera_normal};
    settings.fill = how;
    settings.threads = threads;
    texture_mesh(mesh(), settings);
    return mesh().texturing->fill;
  }

 private:
  synthetic::Photographed photographed_;
};

Hull ball(int stacks = 32) {
  Hull hull;
  synthetic::add_ellipsoid(hull, {0, 1, 0}, {0.4f, 0.4f, 0.4f}, stacks);
  return hull;
}

std::vector<Camera> front() {
  std::vector<Camera> cameras{synthetic::look_at({0, 1, 3}, {0, 1, 0}, 320, 320, 25.0)};
  cameras.front().name = "cam0";
  return cameras;
}

constexpr TextureFill fills[] = {TextureFill::nearest, TextureFill::inpaint};

// One camera sees a ball whose upper half is red and whose lower half is blue: the back is so, too,
// and nowhere anything but a mix of both.
TEST(FillColoursTest, TheBackContinuesTheFront) {
  Stage stage(ball(), front(), [](std::size_t, int, int y) {
    return y < 160 ? Vec3f(200, 0, 0) : Vec3f(0, 0, 200);
  });
  for (const TextureFill how : fills) {
    const std::vector<std::uint32_t>& fill = stage.fill(how);
    ASSERT_EQ(fill.size(), stage.mesh().hull.vertices.size());
    int back = 0;
    for (std::size_t v = 0; v < fill.size(); ++v) {
      const Vec3f& p = stage.mesh().hull.vertices[v];
      if (p.z > -0.05f) continue;
      ++back;
      const Vec3f c = colour(fill[v]);
      EXPECT_NEAR(c.x + c.z, 200.0f, 3.0f) << v;
      EXPECT_EQ(c.y, 0.0f) << v;
      EXPECT_EQ(fill[v] >> 24, 255u);
      const float own = p.y > 1.0f ? c.x : c.z;
      const bool nearest = how == TextureFill::nearest;
      if (std::abs(p.y - 1.0f) > (nearest ? 0.15f : 0.29f)) {
        EXPECT_GT(own, nearest ? 198.0f : 105.0f) << p.y;
      }
      if (std::abs(p.y - 1.0f) > 0.29f && p.z > -0.2f) {
        EXPECT_GT(own, 130.0f) << p.y;
      }
    }
    EXPECT_GT(back, 700);
  }
}

// The nearest colour is one of those that are seen; continued smoothly, neighbours are alike.
TEST(FillColoursTest, NearestIsAsSeenAndInpaintedIsSmooth) {
  Stage stage(ball(), front(), [](std::size_t, int x, int) {
    return x < 160 ? Vec3f(220, 20, 20) : Vec3f(20, 20, 220);
  });
  const Hull& hull = stage.mesh().hull;
  const auto steps = [&](const std::vector<std::uint32_t>& fill) {
    float largest = 0.0f;
    for (std::size_t i = 0; i < hull.triangles.size(); ++i) {
      const std::uint32_t a = hull.triangles[i], b = hull.triangles[i % 3 == 2 ? i - 2 : i + 1];
      if (hull.vertices[a].z > -0.15f || hull.vertices[b].z > -0.15f) continue;
      largest = std::max(largest, glm::distance(colour(fill[a]), colour(fill[b])));
    }
    return largest;
  };
  const std::vector<std::uint32_t> nearest = stage.fill(TextureFill::nearest);
  int mixed = 0;
  for (std::size_t v = 0; v < nearest.size(); ++v) {
    if (hull.vertices[v].z > -0.15f) continue;
    const float red = colour(nearest[v]).x;
    mixed += red > 22.0f && red < 218.0f && std::abs(hull.vertices[v].x) > 0.05f;
  }
  EXPECT_LE(mixed, 80);  // behind the few samples on the border itself
  EXPECT_GT(steps(nearest), 250.0f);
  EXPECT_LT(steps(stage.fill(TextureFill::inpaint)), 80.0f);
}

// A green post stands before a red wall: what it hides of the wall is red, not green, though its
// colours end beside it in the picture, and however large the wall's triangles are.
TEST(FillColoursTest, WhatHidesLeavesNoColourOnWhatItHides) {
  for (const std::uint32_t cells : {40u, 4u}) {
    Hull hull;
    const float cell = 1.0f / static_cast<float>(cells);
    for (std::uint32_t row = 0; row <= cells; ++row)
      for (std::uint32_t column = 0; column <= cells; ++column)
        hull.vertices.emplace_back(-0.5f + cell * static_cast<float>(column),
                                   0.5f + cell * static_cast<float>(row), 0.0f);
    for (std::uint32_t row = 0; row < cells; ++row) {
      for (std::uint32_t column = 0; column < cells; ++column) {
        const std::uint32_t at = (cells + 1) * row + column, up = at + cells + 1;
        for (const std::uint32_t index : {at, at + 1, up + 1, at, up + 1, up})
          hull.triangles.push_back(index);
      }
    }
    const std::size_t wall = hull.vertices.size();
    synthetic::add_box(hull, {-0.1f, 0.5f, 0.5f}, {0.1f, 1.5f, 0.6f});
    const std::vector<Camera> cameras = front();
    const auto half = [&](double z) {  // of the post in the picture
      return cameras[0].project_ideal({0.1, 1, z}).value().x - 159.5;
    };
    Stage stage(hull, cameras, [&](std::size_t, int x, int) {
      return std::abs(x - 159.5) < half(0.6) ? Vec3f(0, 200, 0) : Vec3f(200, 0, 0);
    });
    for (const TextureFill how : fills) {
      const std::vector<std::uint32_t>& fill = stage.fill(how);
      ASSERT_EQ(fill.size(), hull.vertices.size());
      std::uint32_t hidden = 0;
      for (std::size_t v = 0; v < wall; ++v) {
        if (std::abs(hull.vertices[v].x) > 0.1f || std::abs(hull.vertices[v].y - 1.0f) > 0.4f)
          continue;
        ++hidden;
        EXPECT_LT(colour(fill[v]).y, 6.0f) << v;
        EXPECT_GT(colour(fill[v]).x, 194.0f) << v;
      }
      EXPECT_GT(hidden, cells * cells / 8);
    }
  }
}

// A coarse hull's vertices all lie on the rims of what is seen: its faces' middles have the colours.
TEST(FillColoursTest, CoarseHullsTakeWhatTheirFacesShow) {
  Hull box;
  synthetic::add_box(box, {-0.3f, 0.7f, -0.3f}, {0.3f, 1.3f, 0.3f});
  Stage stage(box, front(), [](std::size_t, int, int) { return Vec3f(30, 160, 90); });
  for (const TextureFill how : fills) {
    for (const std::uint32_t rgba : stage.fill(how))
      EXPECT_LT(glm::distance(colour(rgba), Vec3f(30, 160, 90)), 2.0f);
    EXPECT_EQ(stage.mesh().texturing->fill.size(), box.vertices.size());
  }
}

// The hull stays, the pictures change: so do the colours.
TEST(FillColoursTest, TheColoursAreThisInstants) {
  MeshTexturer texturer;
  for (const float value : {40.0f, 180.0f}) {
    Stage stage(ball(12), front(), [&](std::size_t, int, int) { return Vec3f(value); });
    texturer.texture(stage.mesh(), {.metric = TextureMetric::camera_normal});
    EXPECT_EQ(texturer.statistics().reused, value == 180.0f);
    for (const std::uint32_t rgba : stage.mesh().texturing->fill)
      EXPECT_NEAR(colour(rgba).x, value, 1.0f);
  }
}

TEST(FillColoursTest, SameBytesForAnyNumberOfThreads) {
  Stage stage(synthetic::figure(24), synthetic::ring(5, 3.2, 1.5, {0, 1, 0}, 320, 320, 45.0),
              [](std::size_t k, int x, int y) {
                return Vec3f((37 * k + 3 * static_cast<std::size_t>(x)) % 256, y % 256, x % 256);
              });
  for (const TextureFill how : fills) {
    const std::vector<std::uint32_t> one = stage.fill(how, 1);
    EXPECT_FALSE(one.empty());
    for (const int threads : {2, 7}) EXPECT_EQ(stage.fill(how, threads), one);
  }
}

// What a view shows counts with its gain in linear light.
TEST(FillColoursTest, GainsCount) {
  Stage stage(ball(8), front(), [](std::size_t, int, int) { return Vec3f(100, 150, 60); });
  texture_mesh(stage.mesh(), {.metric = TextureMetric::camera_normal});
  const View& view = stage.mesh().views[0].view;
  const FillPicture picture{view.roi, view.stride, view.pixels,
                            Mat3f(2.0f, 0, 0, 0, 0.5f, 0, 0, 0, 1.0f)};
  const std::vector<std::uint32_t> fill = FillColours().find(
      stage.mesh().hull, front(), std::span(&picture, 1), *stage.mesh().texturing, {});
  ASSERT_FALSE(fill.empty());
  for (const std::uint32_t rgba : fill) {
    EXPECT_NEAR(colour(rgba).x, linear_to_srgb(2.0f * srgb_to_linear(100)), 1.0f);
    EXPECT_NEAR(colour(rgba).y, linear_to_srgb(0.5f * srgb_to_linear(150)), 1.0f);
    EXPECT_NEAR(colour(rgba).z, 60.0f, 1.0f);
  }
}

TEST(FillColoursTest, NothingToFillWith) {
  Stage stage(ball(8), front(), [](std::size_t, int, int) { return Vec3f(10, 20, 30); });
  EXPECT_TRUE(stage.fill(TextureFill::grey).empty());
  // Without a picture all is the plain colour.
  stage.mesh().views[0].view.format = PixelFormat::none;
  for (const TextureFill how : fills) {
    for (const std::uint32_t rgba : stage.fill(how)) EXPECT_EQ(rgba, 0xff808080u);
  }
  Mesh empty;
  texture_mesh(empty);
  EXPECT_TRUE(empty.texturing->fill.empty());
}

}  // namespace
}  // namespace polyhull
