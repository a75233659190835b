// SPDX-License-Identifier: LGPL-2.1-or-later
// The image-based hull against the polyhedral one: the same surface, ray by ray.
#include "imagehull/image_hull.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

#include "base/error.h"
#include "hull/build/hull_builder.h"
#include "imagehull/enclosing.h"
#include "raytrace/ray_caster.h"
#include "support/scenes.h"

namespace polyhull {
namespace {

using namespace polyhull::test;

/// Rays through every pixel of a viewport, by both hulls.
struct Comparison {
  int rays = 0, hits = 0;
  int differ = 0;      ///< one hits and the other does not
  int far = 0;         ///< both hit, further apart than a thousandth of a unit
  double worst = 0.0;  ///< relative difference of the others' distances
};

Comparison compare(const HullScene& scene, const Camera& viewport) {
  const std::vector<Silhouette> silhouettes = scene.views();
  HullBuilder builder;
  const Hull& mesh = builder.build(silhouettes);
  RayCaster caster;
  caster.add_mesh(mesh.vertices, mesh.triangles);
  caster.commit();
  const ImageHull hull(silhouettes);
  const Vec3 eye = viewport.centre();
  const ImageHull::Origin origin = hull.from(eye);
  ImageHull::Scratch scratch;
  ImageHull::Bundle bundle;
  float near[ImageHull::lanes];
  std::fill_n(near, ImageHull::lanes, std::numeric_limits<float>::infinity());
  Comparison out;
  for (int y = 0; y < viewport.height; ++y)
    for (int x = 0; x < viewport.width; x += ImageHull::lanes) {
      ImageHull::Directions directions;
      for (int i = 0; i < ImageHull::lanes; ++i) {
        const Vec3f way(viewport.ray({x + i, y}));
        directions.x[i] = way.x;
        directions.y[i] = way.y;
        directions.z[i] = way.z;
      }
      hull.gather(origin,
                  {Vec3f(viewport.ray({x, y - 0.5})), Vec3f(viewport.ray({x + 15, y - 0.5})),
                   Vec3f(viewport.ray({x, y + 0.5})), Vec3f(viewport.ray({x + 15, y + 0.5}))},
                  bundle);
      ImageHull::Hits hits;
      hull.enter(origin, bundle, directions, near, scratch, hits);
      for (int i = 0; i < ImageHull::lanes; ++i) {
        Ray ray;
        ray.origin = Vec3f(eye - mesh.origin);
        ray.direction = Vec3f(directions.x[i], directions.y[i], directions.z[i]);
        const RayHit hit = caster.intersect(ray);
        ++out.rays;
        out.hits += hit.hit();
        if (hit.hit() != (hits.inverse[i] > 0.0f)) {
          ++out.differ;
        } else if (hit.hit()) {
          const double apart = std::abs(1.0 / hits.inverse[i] - hit.distance) / hit.distance;
          if (apart > 1e-3)
            ++out.far;
          else
            out.worst = std::max(out.worst, apart);
        }
      }
    }
  return out;
}

TEST(ImageHullTest, IsThePolyhedralHullRayByRay) {
  for (const int cameras : {2, 4, 8})
    for (const double step : {4.0, 16.0}) {
      const HullScene scene = figure_scene(cameras, step);
      const Comparison c =
          compare(scene, look_at("eye", {2.1, 1.7, 3.2}, {0.0, 0.0, 0.0}, 200.0, 256, 192));
      EXPECT_GT(c.hits, 1500);
      // Rays along an outline or over an edge to the next fold.
      EXPECT_LE(c.differ, 1) << cameras << " cameras, step " << step << " of " << c.hits;
      EXPECT_LE(c.far, 1) << cameras << " cameras, step " << step << " of " << c.hits;
      EXPECT_LT(c.worst, 2e-5) << cameras << " cameras, step " << step;
    }
}

TEST(ImageHullTest, HolesIslandsAndSpecialPositions) {
  int hits = 0, wrong = 0, scenes = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const HullScene scene = random_scene(seed);
    // Of cameras in one place the polyhedral hull ends close to them (hull.h).
    double apart = 0.0;
    for (const Camera& camera : scene.rig.cameras)
      apart = std::max(apart, glm::distance(camera.centre(), scene.rig.cameras[0].centre()));
    if (apart < 1e-3) continue;
    const Comparison c =
        compare(scene, look_at("eye", {2.9, -2.2, 3.6}, {0.0, 0.0, 0.0}, 160.0, 128, 96));
    hits += c.hits;
    wrong += c.differ + c.far;
    ++scenes;
  }
  EXPECT_GT(scenes, 80);
  EXPECT_GT(hits, 10000);
  EXPECT_LE(wrong, hits / 1000);
}

TEST(ImageHullTest, FromACameraItIsItsSilhouette) {
  const HullScene scene = figure_scene(4, 8.0);
  const Camera& camera = scene.rig.cameras[1];
  const Comparison c = compare(scene, camera);
  EXPECT_GT(c.hits, 20000);
  // Within a few ten-thousandths of a pixel of the outline: the eye stands a little behind the camera.
  EXPECT_LE(c.differ, c.hits / 1000);
  EXPECT_LE(c.far, c.hits / 1000);
}

/// One ray through the middle of \p hull from \p eye, beyond \p near.
float entry(const ImageHull& hull, const Vec3& eye, const Vec3& way, float inverse_near) {
  ImageHull::Directions directions;
  float near[ImageHull::lanes];
  for (int i = 0; i < ImageHull::lanes; ++i) {
    directions.x[i] = static_cast<float>(way.x);
    directions.y[i] = static_cast<float>(way.y);
    directions.z[i] = static_cast<float>(way.z);
    near[i] = inverse_near;
  }
  ImageHull::Scratch scratch;
  ImageHull::Hits hits;
  hull.enter(hull.from(eye), hull.all(), directions, near, scratch, hits);
  return hits.inverse[5];
}

/// Three cameras on the axes, 4 units away, that see squares: a cube from -1 to 1, nearly.
HullScene cube_scene() {
  HullScene scene;
  for (int axis = 0; axis < 3; ++axis) {
    Vec3 centre(0.0);
    centre[axis] = 4.0;
    scene.rig.cameras.push_back(look_at("c" + std::to_string(axis), centre, Vec3(0.0), 400.0));
    const float x = 512.0f, y = 384.0f, half = 100.0f;
    add_ring(
        scene.silhouettes.emplace_back(),
        {{x - half, y - half}, {x - half, y + half}, {x + half, y + half}, {x + half, y - half}});
  }
  return scene;
}

TEST(ImageHullTest, BeginsWhereItIsAsked) {
  const HullScene scene = cube_scene();
  const ImageHull hull(scene.views());
  ASSERT_FALSE(hull.empty());
  const Vec3 eye(-4.0, -4.0, -4.0), way(1.0, 1.0, 1.0);
  const float first = entry(hull, eye, way, INFINITY);
  EXPECT_NEAR(1.0 / first, 8.0 / 3.0, 1e-5);  // the pyramids' sides meet at -4/3
  // Beyond its entry the ray is inside: it must leave first, and never comes again.
  EXPECT_EQ(entry(hull, eye, way, 1.0f / 3.5f), 0.0f);
  EXPECT_EQ(entry(hull, Vec3(0.0), way, INFINITY), 0.0f);
  // Away from it.
  EXPECT_EQ(entry(hull, eye, -way, INFINITY), 0.0f);
}

TEST(ImageHullTest, FacesAreTheViewsPlanes) {
  const HullScene scene = cube_scene();
  const ImageHull hull(scene.views());
  EXPECT_EQ(hull.faces(), 12u);
  for (std::uint32_t face = 0; face < hull.faces(); ++face) {
    EXPECT_EQ(hull.view_of(face), face / 4);
    const Vec3 across(hull.across(face));
    EXPECT_NEAR(glm::length(across), 1.0, 1e-6);
    // The plane holds the camera's centre and is tilted by the pyramid's angle, 1 : 4.
    const Camera& camera = scene.rig.cameras[face / 4];
    const double along = glm::dot(across, glm::transpose(camera.R) * Vec3(0.0, 0.0, 1.0));
    EXPECT_NEAR(std::abs(along), 1.0 / std::sqrt(17.0), 1e-6);
  }
}

TEST(ImageHullTest, EnclosingCornersHoldTheHull) {
  for (const int cameras : {2, 3, 8, 12}) {
    const HullScene scene = figure_scene(cameras, 8.0);
    HullBuilder builder;
    const Hull& mesh = builder.build(scene.views());
    const std::vector<Vec3> corners = enclosing_corners(scene.views());
    ASSERT_FALSE(corners.empty());
    // In every direction they reach as far, and with many cameras not much further.
    double most = 0.0;
    Dice dice(7);
    for (int i = 0; i < 50; ++i) {
      const Vec3 way = dice.direction();
      double outer = -1e9, inner = -1e9;
      for (const Vec3& corner : corners) outer = std::max(outer, glm::dot(way, corner));
      for (const Vec3f& v : mesh.vertices)
        inner = std::max(inner, glm::dot(way, mesh.origin + Vec3(v)));
      EXPECT_GE(outer, inner - 1e-5);
      most = std::max(most, outer - inner);
    }
    if (cameras >= 3) {
      EXPECT_LT(most, 1.0) << cameras;
    }
  }
}

TEST(ImageHullTest, OfNothingThereIsNothing) {
  HullScene scene = cube_scene();
  EXPECT_TRUE(ImageHull({}).empty());
  EXPECT_TRUE(ImageHull(std::vector<Silhouette>{scene.views()[0]}).empty());
  const ImageHull::Origin origin = ImageHull({}).from(Vec3(1.0));
  EXPECT_TRUE(origin.start.empty());
  const HullScene whole = scene;
  scene.silhouettes[1] = {};
  const ImageHull without(scene.views());
  EXPECT_TRUE(without.empty());
  EXPECT_EQ(entry(without, {-4, -4, -4}, {1, 1, 1}, INFINITY), 0.0f);
  // Silhouettes side by side: the cones pass each other.
  scene = whole;
  for (Vec2f& p : scene.silhouettes[0].points) p.x += 350.0f;
  for (Vec2f& p : scene.silhouettes[1].points) p.x += 350.0f;
  for (Vec2f& p : scene.silhouettes[2].points) p.x += 350.0f;
  const ImageHull apart(scene.views());
  EXPECT_EQ(entry(apart, {-4, -4, -4}, {1, 1, 1}, INFINITY), 0.0f);
}

TEST(ImageHullTest, RefusesWhatIsNotFinite) {
  for (const float bad : {NAN, INFINITY, 1e8f}) {
    HullScene scene = cube_scene();
    scene.silhouettes[1].points[2].y = bad;
    EXPECT_THROW(ImageHull(scene.views()), Error) << bad;
  }
  HullScene scene = cube_scene();
  scene.rig.cameras[0].t.x = NAN;
  EXPECT_THROW(ImageHull(scene.views()), Error);
  scene = cube_scene();
  scene.rig.cameras[2].K[0][0] = 0.0;
  EXPECT_THROW(ImageHull(scene.views()), Error);
}

TEST(ImageHullTest, EveryInstructionSetGivesTheSameBits) {
  const HullScene scene = figure_scene(5, 8.0);
  const Camera& camera = scene.rig.cameras[0];
  // The edges of one view by both, whose walk is tested by all of the above.
  std::vector<float> points, boxes[4];
  std::vector<std::uint32_t> first;
  Dice dice(3);
  for (std::uint32_t c = 0; c < 40; ++c) {
    float x[5], y[5], low_x = 1e9f, high_x = -1e9f, low_y = 1e9f, high_y = -1e9f;
    for (int i = 0; i < 5; ++i) {
      x[i] = static_cast<float>(dice.between(-200, 200));
      y[i] = static_cast<float>(dice.between(-200, 200));
      low_x = std::min(low_x, x[i]), high_x = std::max(high_x, x[i]);
      low_y = std::min(low_y, y[i]), high_y = std::max(high_y, y[i]);
    }
    points.insert(points.end(), x, x + 5);
    points.insert(points.end(), y, y + 5);
    boxes[0].push_back(0.5f * (low_x + high_x));
    boxes[1].push_back(0.5f * (low_y + high_y));
    boxes[2].push_back(0.5f * (high_x - low_x) + 0.01f);
    boxes[3].push_back(0.5f * (high_y - low_y) + 0.01f);
    first.push_back(4 * c);
  }
  const imagehull::Chains chains{40,
                                 boxes[0].data(),
                                 boxes[1].data(),
                                 boxes[2].data(),
                                 boxes[3].data(),
                                 points.data(),
                                 first.data()};
  const Mat3 turn = camera.K * camera.R;
  float rows[9];
  const std::array<double, 9> exact = to_rows(turn);
  std::copy(exact.begin(), exact.end(), rows);
  const float start[3] = {310.0f, -120.0f, 2.5f};
  imagehull::Directions rays;
  for (int i = 0; i < imagehull::lanes; ++i) {
    rays.x[i] = static_cast<float>(dice.between(-1, 1));
    rays.y[i] = static_cast<float>(dice.between(-1, 1));
    rays.z[i] = static_cast<float>(dice.between(-1, 1));
  }
  std::vector<std::uint32_t> all(40);
  for (std::uint32_t i = 0; i < 40; ++i) all[i] = i;
  const auto run = [&](const imagehull::Loops& loops) {
    std::vector<float> inverse(160 * imagehull::lanes);
    std::vector<std::uint32_t> edges(160);
    const int found =
        loops.cross(chains, all.data(), 40, start, rows, rays, inverse.data(), edges.data());
    EXPECT_GT(found, 40);
    inverse.resize(static_cast<std::size_t>(found) * imagehull::lanes);
    edges.resize(static_cast<std::size_t>(found));
    const imagehull::ViewCrossings views[2] = {{0, found / 2, 0}, {found / 2, found, 1}};
    float near[imagehull::lanes], entry[imagehull::lanes];
    std::fill_n(near, imagehull::lanes, INFINITY);
    std::vector<std::uint32_t> edge(imagehull::lanes);
    loops.enter(views, 2, inverse.data(), edges.data(), near, entry, edge.data());
    inverse.insert(inverse.end(), entry, entry + imagehull::lanes);
    edges.insert(edges.end(), edge.begin(), edge.end());
    return std::pair(inverse, edges);
  };
  EXPECT_EQ(run(imagehull::Loops::baseline()), run(imagehull::Loops::best()));
}

}  // namespace
}  // namespace polyhull
