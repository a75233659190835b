// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/texture_hull.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "base/error.h"
#include "raytrace/ray_caster.h"
#include "synthetic.h"

namespace polyhull {
namespace {

const TextureSettings by_normal{.metric = TextureMetric::camera_normal};

using synthetic::ring;

/// Moeller-Trumbore in double precision: whether the open segment p-q meets triangle a b c.
bool meets(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 d = q - p, e1 = b - a, e2 = c - a;
  const Vec3 h = glm::cross(d, e2);
  const double det = glm::dot(e1, h);
  if (det == 0.0) return false;
  const Vec3 s = p - a;
  const double u = glm::dot(s, h) / det;
  const Vec3 r = glm::cross(s, e1);
  const double v = glm::dot(d, r) / det;
  const double w = glm::dot(e2, r) / det;
  return u >= 0.0 && v >= 0.0 && u + v <= 1.0 && w > 1e-9 && w < 1.0;
}

Vec3 corner(const Hull& hull, std::size_t f, int i) {
  return Vec3(hull.vertices[hull.triangles[3 * f + i]]);
}

bool hidden(const Hull& hull, std::size_t own, const Vec3& p, const Vec3& q) {
  for (std::size_t f = 0; f < hull.triangles.size() / 3; ++f) {
    if (f != own && meets(p, q, corner(hull, f, 0), corner(hull, f, 1), corner(hull, f, 2)))
      return true;
  }
  return false;
}

TEST(Texture, VisibilityAgreesWithBruteForceByArea) {
  const Hull hull = synthetic::figure(14);
  const std::vector<Camera> cameras = ring(4, 3.5, 1.6, {0, 1, 0});
  const Texturing texturing = texture_hull(hull, cameras, by_normal);
  double agree = 0.0, all = 0.0;
  std::vector<Vec3f> points;
  for (std::size_t f = 0; f < hull.triangles.size() / 3; ++f) {
    const Vec3 a = corner(hull, f, 0), b = corner(hull, f, 1), c = corner(hull, f, 2);
    const Vec3 cross = glm::cross(b - a, c - a);
    const Vec3 normal = glm::normalize(cross);
    for (std::size_t k = 0; k < cameras.size(); ++k) {
      const Vec3 centre = cameras[k].centre();
      // Points of the test's own: the middle and three between it and the corners.
      const Vec3 middle = (a + b + c) / 3.0;
      if (glm::dot(normal, centre - middle) <= 0.0) {
        EXPECT_FALSE(texturing.visible[f] >> k & 1) << "back face " << f << " view " << k;
        continue;
      }
      const bool visible = texturing.visible[f] >> k & 1;
      for (const Vec3& p : {middle, 0.5 * (middle + a), 0.5 * (middle + b), 0.5 * (middle + c)}) {
        const bool seen = !hidden(hull, f, p + 1e-6 * normal, centre);
        all += glm::length(cross);
        if (seen == visible) agree += glm::length(cross);
      }
    }
  }
  // Triangles that an occlusion boundary crosses cannot agree in all their parts.
  EXPECT_GT(agree / all, 0.97);
  RecordProperty("agreement", std::to_string(agree / all));
  std::printf("visibility agrees with brute force on %.3f %% of the facing area\n",
              100.0 * agree / all);
}

TEST(Texture, BestCameraHasTheSmallestAngleAmongThoseThatSee) {
  Hull hull;
  synthetic::add_ellipsoid(hull, {0, 1, 0}, {0.5f, 0.5f, 0.5f}, 12);
  const std::vector<Camera> cameras = ring(6, 3.0, 1.0, {0, 1, 0});
  const Texturing texturing = texture_hull(hull, cameras, by_normal);
  int none = 0;
  for (std::size_t f = 0; f < hull.triangles.size() / 3; ++f) {
    const Vec3 a = corner(hull, f, 0), b = corner(hull, f, 1), c = corner(hull, f, 2);
    const Vec3 normal = glm::normalize(glm::cross(b - a, c - a));
    const Vec3 middle = (a + b + c) / 3.0;
    double best = 0.0;
    int expected = -1;
    for (std::size_t k = 0; k < cameras.size(); ++k) {
      const double cosine = glm::dot(normal, glm::normalize(cameras[k].centre() - middle));
      if (cosine > std::max(best, 1e-3)) best = cosine, expected = static_cast<int>(k);
    }
    EXPECT_EQ(texturing.best[f], expected);
    none += expected < 0;
  }
  EXPECT_GT(none, 0);  // the poles look at no camera
}

TEST(Texture, FacesOfACamerasOwnConeAreNotVisibleInIt) {
  Hull hull;
  synthetic::add_box(hull, {-1, -1, -1}, {1, 1, 1});
  const std::vector<Camera> cameras = ring(2, 5.0, 0.0, {0, 0, 0});
  hull.faces = {{0, 0, 0, 12}};
  const Texturing texturing = texture_hull(hull, cameras, by_normal);
  for (const std::uint64_t mask : texturing.visible) EXPECT_EQ(mask & 1, 0u);
}

TEST(Texture, OcclusionOffSeesEverythingThatFaces) {
  const Hull hull = synthetic::figure(8);
  const std::vector<Camera> cameras = ring(4, 3.5, 1.6, {0, 1, 0});
  TextureSettings settings = by_normal;
  settings.occlusion = false;
  const Texturing off = texture_hull(hull, cameras, settings);
  const Texturing on = texture_hull(hull, cameras, by_normal);
  EXPECT_TRUE(off.maps.empty());
  std::size_t more = 0;
  for (std::size_t f = 0; f < off.visible.size(); ++f) {
    EXPECT_EQ(on.visible[f] & ~off.visible[f], 0u);
    more += off.visible[f] != on.visible[f];
  }
  EXPECT_GT(more, 0u);
}

TEST(Texture, WeightsNormalsAndSizes) {
  Hull hull;
  synthetic::add_ellipsoid(hull, {0, 1, 0}, {0.5f, 0.5f, 0.5f}, 16);
  hull.origin = {100.0, -50.0, 1000.0};
  std::vector<Camera> cameras = ring(4, 3.0, 1.0, {0, 1, 0});
  for (Camera& camera : cameras) camera.t -= camera.R * hull.origin;
  const Texturing texturing = texture_hull(hull, cameras, by_normal);
  ASSERT_EQ(texturing.normals.size(), hull.vertices.size());
  ASSERT_EQ(texturing.weights.size(), hull.vertices.size() * 4);
  ASSERT_EQ(texturing.maps.size(), 4u);
  for (std::size_t v = 0; v < hull.vertices.size(); ++v) {
    const Vec3f outward = glm::normalize(hull.vertices[v] - Vec3f(0, 1, 0));
    EXPECT_GT(glm::dot(outward, texturing.normals[v]), 0.98f);
    for (std::size_t k = 0; k < 4; ++k) {
      const float weight = texturing.weights[4 * v + k];
      const Vec3f way = glm::normalize(Vec3f(cameras[k].centre() - hull.origin) - hull.vertices[v]);
      EXPECT_NEAR(weight, std::max(0.0f, glm::dot(texturing.normals[v], way)), 0.06f);
    }
  }
}

TEST(Texture, MapHoldsTheNearestDepthAndFadesAtEveryEdge) {
  const Hull hull = synthetic::figure(20);
  const Camera camera = ring(1, 3.5, 1.6, {0, 1, 0})[0];
  TextureSettings settings = by_normal;
  settings.map_size = 256;
  const OcclusionMap map = texture_hull(hull, std::vector<Camera>{camera}, settings).maps[0];
  ASSERT_GT(map.width, 16);
  RayCaster caster;
  caster.add_mesh(hull.vertices, hull.triangles);
  caster.commit();
  const Vec3 centre = camera.centre();
  int checked = 0, boundaries = 0;
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const std::size_t p = static_cast<std::size_t>(y) * map.width + x;
      const Vec2 pixel(map.x + x * map.step, map.y + y * map.step);
      const RayHit hit = caster.intersect({Vec3f(centre), 0.0f, Vec3f(camera.ray(pixel))});
      if (map.fade[p] > 0) {
        ASSERT_TRUE(hit.hit()) << "fade outside the silhouette at " << x << " " << y;
        const float depth = map.near + (map.far - map.near) * map.depth[p] / 65534.0f;
        // Never nearer than the surface, and farther only by the slope of a texel or two.
        EXPECT_GT(depth, hit.distance - 1e-3f);
        EXPECT_LT(depth, hit.distance + 0.12f);
        ++checked;
      } else if (hit.hit()) {
        ++boundaries;
      }
    }
  }
  EXPECT_GT(checked, 2000);
  EXPECT_GT(boundaries, 300);
  for (int x = 0; x < map.width; ++x) EXPECT_EQ(map.fade[x], 0);
}

TEST(Texture, WhatLiesOutsideTheFrameIsNotSeen) {
  const Hull hull = synthetic::figure(10);
  // Turned up: the frame ends at about the figure's middle.
  const Camera camera = synthetic::look_at({0, 1.0, 4}, {0, 2.2, 0}, 640, 480, 40.0);
  const Texturing texturing = texture_hull(hull, std::vector<Camera>{camera}, by_normal);
  int seen = 0;
  for (std::size_t f = 0; f < hull.triangles.size() / 3; ++f) {
    if (!(texturing.visible[f] & 1)) continue;
    ++seen;
    const Vec3 middle = (corner(hull, f, 0) + corner(hull, f, 1) + corner(hull, f, 2)) / 3.0;
    const auto pixel = camera.project(middle);
    ASSERT_TRUE(pixel.has_value());
    EXPECT_LT(pixel->y, 500.0);
  }
  EXPECT_GT(seen, 20);
  const OcclusionMap& map = texturing.maps[0];
  for (int y = 0; y < map.height; ++y) {
    if (map.y + y * map.step < 479.0f) continue;
    for (int x = 0; x < map.width; ++x)
      EXPECT_EQ(map.fade[static_cast<std::size_t>(y) * map.width + x], 0);
  }
}

// Each of the frame's sides, through the figure's middle.
TEST(Texture, EverySideOfTheFrameEndsWhatIsSeen) {
  const Hull hull = synthetic::figure(10);
  for (const Vec3& target :
       {Vec3(0, 2.2, 0), Vec3(0, -0.2, 0), Vec3(1.45, 1, 0), Vec3(-1.45, 1, 0)}) {
    const Camera camera = synthetic::look_at({0, 1.0, 4}, target, 640, 480, 40.0);
    const Texturing texturing = texture_hull(hull, std::vector<Camera>{camera}, by_normal);
    int seen = 0, outside = 0;
    for (std::size_t f = 0; f < hull.triangles.size() / 3; ++f) {
      const Vec3 middle = (corner(hull, f, 0) + corner(hull, f, 1) + corner(hull, f, 2)) / 3.0;
      const Vec2 pixel = camera.project(middle).value();
      const bool inside = pixel.x > -25.0 && pixel.y > -25.0 && pixel.x < 664.0 && pixel.y < 504.0;
      outside += !inside;
      if (!(texturing.visible[f] & 1)) continue;
      ++seen;
      EXPECT_TRUE(inside) << pixel.x << " " << pixel.y;
    }
    EXPECT_GT(seen, 20) << target.x << " " << target.y;
    EXPECT_GT(outside, 20) << target.x << " " << target.y;
  }
}

TEST(Texture, SameHullGivesTheLastResult) {
  const Hull hull = synthetic::figure(6);
  std::vector<Camera> cameras = ring(2, 3.5, 1.6, {0, 1, 0});
  HullTexturer texturer;
  texturer.texture(hull, cameras, by_normal);
  EXPECT_FALSE(texturer.statistics().reused);
  texturer.texture(hull, cameras, by_normal);
  EXPECT_TRUE(texturer.statistics().reused);
  cameras[1].t.x += 0.1;
  const Texturing moved = texturer.texture(hull, cameras, by_normal);
  EXPECT_FALSE(texturer.statistics().reused);
  EXPECT_EQ(moved.weights, texture_hull(hull, cameras, by_normal).weights);
}

TEST(Texture, NormalsOfASmoothSurfaceAreTaken) {
  Hull hull = synthetic::figure(6);
  const std::vector<Camera> cameras = ring(3, 3.5, 1.6, {0, 1, 0});
  HullTexturer texturer;
  const Texturing own = texturer.texture(hull, cameras, by_normal);
  hull.normals.assign(hull.vertices.size(), Vec3f(0.0f, 0.6f, 0.8f));
  const Texturing given = texturer.texture(hull, cameras, by_normal);
  EXPECT_FALSE(texturer.statistics().reused);
  EXPECT_EQ(given.normals, hull.normals);
  EXPECT_EQ(given.visible, own.visible);
  EXPECT_NE(given.weights, own.weights);
}

TEST(Texture, SameResultOnOneThreadAndMany) {
  const Hull hull = synthetic::figure(12);
  const std::vector<Camera> cameras = ring(4, 3.5, 1.6, {0, 1, 0});
  TextureSettings one = by_normal, many = by_normal;
  one.threads = 1;
  many.threads = 4;
  const Texturing a = texture_hull(hull, cameras, one);
  const Texturing b = texture_hull(hull, cameras, many);
  EXPECT_EQ(a.visible, b.visible);
  EXPECT_EQ(a.best, b.best);
  EXPECT_EQ(a.weights, b.weights);
  EXPECT_EQ(a.maps, b.maps);
}

TEST(Texture, EmptyDegenerateAndBrokenInput) {
  const std::vector<Camera> cameras = ring(2, 3.0, 1.0, {0, 1, 0});
  EXPECT_TRUE(texture_hull(Hull{}, cameras).visible.empty());
  Hull flat;
  flat.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  flat.triangles = {0, 1, 2, 0, 0, 0};
  const Texturing texturing = texture_hull(flat, cameras, by_normal);
  EXPECT_EQ(texturing.visible, std::vector<std::uint64_t>(2, 0));
  Hull broken = flat;
  broken.triangles = {0, 1, 7};
  EXPECT_THROW(texture_hull(broken, cameras), Error);
  broken = flat;
  broken.vertices[1].y = std::nanf("");
  EXPECT_THROW(texture_hull(broken, cameras), Error);
  EXPECT_THROW(texture_hull(synthetic::figure(4), ring(65, 3.0, 1.0, {0, 1, 0})), Error);
  EXPECT_TRUE(texture_hull(synthetic::figure(4), {}).weights.empty());
}

TEST(Texture, SpeedOf20kTriangles) {
  const Hull hull = synthetic::figure(36);
  const std::vector<Camera> cameras = ring(4, 3.5, 1.6, {0, 1, 0}, 1024, 768);
  HullTexturer texturer;
  double best = 1e9;
  TextureStatistics statistics;
  for (int i = 0; i < 10; ++i) {
    const auto start = std::chrono::steady_clock::now();
    TextureSettings settings = by_normal;
    settings.fade_width += i;  // so that nothing is reused
    texturer.texture(hull, cameras, settings);
    const double ms =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    if (ms < best) best = ms, statistics = texturer.statistics();
  }
  std::printf("%zu triangles, 4 views: %.1f ms (visibility %.1f, weights %.1f)\n",
              hull.triangles.size() / 3, best, 1e3 * statistics.seconds_visibility,
              1e3 * statistics.seconds_weights);
}

}  // namespace
}  // namespace polyhull
