// SPDX-License-Identifier: LGPL-2.1-or-later
// HullBuilder on figures and by its rules: order, threads, reuse, bounds, unseen space, refusals.
// hull_scenes_test holds it against the scenes with known volumes, hull_reference_test against
// exact references, tests/stress against what is degenerate.
#include "hull/hull.h"
#include "hull/build/hull_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/thread_pool.h"
#include "support/degenerate_scenes.h"
#include "support/hull_expectations.h"

namespace polyhull::test {
namespace {

Hull build(const HullScene& scene, const HullOptions& options = {}) {
  HullBuilder builder;
  return builder.build(scene.views(), options);
}

Rings ring_of(const std::vector<Vec2f>& ring) {
  Rings rings;
  add_ring(rings, ring);
  return rings;
}

TEST(Hull, FigureIsRight) {
  for (const HullScene& scene : {figure_scene(4, 16), figure_scene(7, 20), knot_scene(5, 16)}) {
    const auto views = scene.views();
    expect_right(build(scene), views, {}, scene.name, {.points = 100000});
    expect_right(build(scene, within(scene)), views, within(scene), scene.name + " in bounds");
  }
}

TEST(Hull, BoxFromThreeSides) {
  // Three cameras at distance 4 on the axes, each seeing the box |x| <= 1 in its perspective: the
  // hull's faces are the silhouettes' planes, all through the box's near corners' rays.
  Rings square = ring_of({{256, 128}, {256, 640}, {768, 640}, {768, 128}});
  const Camera front = axis_camera("front", {0, 0, -4}, 5);
  const Silhouette one[] = {{&front, &square}};
  HullOptions options;
  options.bounds = Bounds{Vec3(-8), Vec3(8, 8, 4)};
  HullBuilder builder;
  const Hull hull = builder.build(one, options);
  // A pyramid of height 8 from the camera to z = 4, base 2 z' / 4 wide: (4 * 2) ^ 2 ... area 16,
  // / 3.
  EXPECT_TRUE(check_mesh(hull).sound()) << check_mesh(hull).describe();
  EXPECT_NEAR(check_mesh(hull).volume, 4.0 * 4.0 * 8.0 / 3.0, 1e-5);
  EXPECT_EQ(hull.faces.size(), 5u);
}

TEST(Hull, SameBytesOnAnyNumberOfThreads) {
  const HullScene scene = figure_scene(6, 6);
  set_pool_threads(4);
  HullOptions options;
  const Hull one = build(scene, options);
  for (int threads : {2, 3, 4}) {
    options.threads = threads;
    for (int round = 0; round < 3; ++round) {
      EXPECT_TRUE(same_bytes(build(scene, options), one)) << threads << " threads";
    }
  }
  set_pool_threads(0);
}

TEST(Hull, SameBytesFromANewAndAUsedBuilder) {
  HullBuilder builder;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const HullScene scene =
        seed % 4 == 0 ? figure_scene(3 + int(seed % 5), 20, double(seed)) : random_scene(seed);
    const auto views = scene.views();
    EXPECT_TRUE(same_bytes(builder.build(views, within(scene)), build(scene, within(scene))))
        << scene.name;
  }
}

TEST(Hull, UnchangedSilhouettesAreReused) {
  HullScene scene = figure_scene(5, 12);
  HullBuilder builder;
  const Hull first = builder.build(scene.views());
  EXPECT_FALSE(builder.statistics().reused);
  EXPECT_TRUE(same_bytes(builder.build(scene.views()), first));
  EXPECT_TRUE(builder.statistics().reused);
  EXPECT_EQ(builder.statistics().predicates, 0u) << "figures are of the last call";
  EXPECT_EQ(builder.statistics().seconds_faces + builder.statistics().seconds_triangulate, 0.0);
  // Equal content at another address is unchanged, too.
  HullScene copy = scene;
  EXPECT_TRUE(same_bytes(builder.build(copy.views()), first));
  EXPECT_TRUE(builder.statistics().reused);
  // Any change is not: a vertex, a camera, an option.
  copy.silhouettes[2].points[5].x += 0.5f;
  builder.build(copy.views());
  EXPECT_FALSE(builder.statistics().reused);
  EXPECT_TRUE(same_bytes(builder.build(scene.views()), first));
  EXPECT_FALSE(builder.statistics().reused);
  scene.rig.cameras[1].t.x += 1e-3;
  EXPECT_FALSE(same_bytes(builder.build(scene.views()), first));
  EXPECT_FALSE(builder.statistics().reused);
  HullOptions options;
  options.bounds = Bounds{Vec3(-0.2), Vec3(0.2)};
  const Hull cut = builder.build(scene.views(), options);
  EXPECT_FALSE(builder.statistics().reused);
  EXPECT_LT(check_mesh(cut).volume, check_mesh(first).volume);
  options.reuse = false;
  EXPECT_TRUE(same_bytes(builder.build(scene.views(), options), cut));
  EXPECT_FALSE(builder.statistics().reused);
}

TEST(Hull, OneChangedCameraGivesWhatANewBuilderGives) {
  HullBuilder builder;
  HullScene scene = figure_scene(6, 12);
  builder.build(scene.views());
  for (std::size_t changed = 0; changed < 6; ++changed) {
    scene.silhouettes[changed] =
        figure_scene(6, 12, 0.3 + 0.1 * double(changed)).silhouettes[changed];
    EXPECT_TRUE(same_bytes(builder.build(scene.views()), build(scene))) << "camera " << changed;
    EXPECT_FALSE(builder.statistics().reused);
  }
}

TEST(Hull, OrderOfCamerasDoesNotMatter) {
  const HullScene scene = figure_scene(5, 16);
  const Hull reference = build(scene);
  std::vector<std::size_t> order{3, 0, 4, 2, 1};
  std::vector<Silhouette> views;
  for (std::size_t i : order) views.push_back(scene.views()[i]);
  HullBuilder builder;
  Hull hull = builder.build(views);
  expect_right(hull, views, {}, "other order");
  // The surface is the same; only the numbers of the views differ.
  EXPECT_EQ(hull.vertices.size(), reference.vertices.size());
  EXPECT_EQ(hull.faces.size(), reference.faces.size());
  EXPECT_NEAR(check_mesh(hull).volume / check_mesh(reference).volume, 1.0, 1e-9);
}

TEST(Hull, FirstVertexOfARingDoesNotMatter) {
  HullScene scene = figure_scene(4, 16);
  const Hull reference = build(scene);
  for (Rings& rings : scene.silhouettes) {
    std::size_t begin = 0;
    for (std::uint32_t end : rings.ends) {
      std::rotate(rings.points.begin() + begin, rings.points.begin() + (begin + end) / 2,
                  rings.points.begin() + end);
      begin = end;
    }
  }
  const Hull hull = build(scene);
  expect_right(hull, scene.views(), {}, "rotated rings");
  EXPECT_EQ(hull.vertices.size(), reference.vertices.size());
  EXPECT_NEAR(check_mesh(hull).volume / check_mesh(reference).volume, 1.0, 1e-9);
}

TEST(Hull, DirectionOfARingDoesNotMatter) {
  HullScene scene = figure_scene(4, 16);
  const Hull reference = build(scene);
  Rings& rings = scene.silhouettes[1];
  std::reverse(rings.points.begin(), rings.points.begin() + rings.ends[0]);
  const Hull hull = build(scene);
  expect_right(hull, scene.views(), {}, "reversed ring", {.simple = false});
  EXPECT_EQ(hull.vertices.size(), reference.vertices.size());
}

TEST(Hull, FarAndHugeAndTiny) {
  const HullScene scene = figure_scene(5, 16);
  const double volume = check_mesh(build(scene)).volume;
  for (double scale : {1e-9, 1e-6, 1e6, 1e9}) {
    const HullScene scaled = moved(scene, scale, Vec3(0.0));
    const Hull hull = build(scaled);
    expect_right(hull, scaled.views(), {}, "scale " + std::to_string(scale));
    EXPECT_NEAR(check_mesh(hull).volume / (volume * scale * scale * scale), 1.0, 1e-6);
  }
  const HullScene far = moved(scene, 1.0, Vec3(1e6, -2e6, 3e6));
  const Hull hull = build(far);
  expect_right(hull, far.views(), {}, "far");
  EXPECT_NEAR(check_mesh(hull).volume / volume, 1.0, 1e-6);
  EXPECT_LT(glm::length(hull.origin - Vec3(1e6, -2e6, 3e6)), 3.0)
      << "the origin carries the distance";
}

TEST(Hull, FewerThanTwoCameras) {
  HullBuilder builder;
  EXPECT_TRUE(builder.build({}).empty());
  HullOptions box;
  box.bounds = Bounds{Vec3(-1), Vec3(1)};
  // No camera at all: nothing is known of the subject. One camera: its cone, which only bounds can
  // end.
  const HullScene scene = figure_scene(2, 16);
  const auto views = scene.views();
  const std::span<const Silhouette> one(views.data(), 1);
  expect_right(builder.build(one, box), one, box, "one camera in bounds");
  EXPECT_FALSE(builder.build(one, box).empty());
  const Hull& open = builder.build(one);
  EXPECT_TRUE(check_mesh(open).sound());
}

TEST(Hull, EmptySilhouettes) {
  HullScene scene = figure_scene(4, 16);
  scene.silhouettes[2].clear();
  EXPECT_TRUE(build(scene).empty()) << "carve: nothing is seen by camera 2";
  HullOptions keep = within(scene);
  keep.unseen = Unseen::keep;
  // What camera 2 sees is empty, what it does not see may be filled.
  expect_right(build(scene, keep), scene.views(), keep, "keep, one silhouette empty");
  for (Rings& rings : scene.silhouettes) rings.clear();
  EXPECT_TRUE(build(scene).empty());
}

TEST(Hull, UnseenSpaceIsCarvedOrKept) {
  HullScene scene = figure_scene(4, 16);
  // Camera 1 looks past most of the figure.
  scene.rig.cameras[1].K[2][0] -= 560;
  for (Vec2f& p : scene.silhouettes[1].points) p.x -= 560;
  HullScene cut = scene;
  HullOptions carve = within(scene), keep = within(scene);
  keep.unseen = Unseen::keep;
  const Hull carved = build(cut, carve), kept = build(cut, keep);
  expect_right(kept, cut.views(), keep, "keep", {.simple = false});
  expect_right(carved, cut.views(), carve, "carve", {.simple = false});
  EXPECT_GT(check_mesh(kept).volume, 1.02 * check_mesh(carved).volume);
}

TEST(Hull, BoundsThatMissTheHullLeaveNothing) {
  HullOptions options;
  options.bounds = Bounds{Vec3(5), Vec3(6)};
  EXPECT_TRUE(build(figure_scene(4, 16), options).empty());
}

TEST(Hull, BoundsInsideTheHullAreTheHull) {
  HullOptions options;
  options.bounds = Bounds{Vec3(-0.02, -0.02, 0.2), Vec3(0.02, 0.02, 0.25)};
  const Hull hull = build(figure_scene(4, 16), options);
  EXPECT_EQ(hull.faces.size(), 6u);
  EXPECT_EQ(hull.triangles.size(), 36u);
  EXPECT_NEAR(check_mesh(hull).volume, 0.04 * 0.04 * 0.05, 1e-9);
}

TEST(Hull, SimplificationKeepsItsPromise) {
  const HullScene scene = figure_scene(6, 8);
  const Hull exact = build(scene);
  const double exact_volume = check_mesh(exact).volume;
  for (double deviation : {1e-4, 1e-3}) {
    HullOptions options;
    options.max_deviation = deviation;
    const Hull hull = build(scene, options);
    const MeshReport report = check_mesh(hull);
    EXPECT_TRUE(report.sound()) << report.describe();
    EXPECT_LE(report.triangles, exact.triangles.size() / 3);
    EXPECT_LE(report.sliver_share(), 0.01) << report.describe();
    EXPECT_NEAR(report.volume / exact_volume, 1.0, 50 * deviation);
    double worst = 0.0;
    for (std::size_t i = 0; i < hull.vertices.size(); i += 7) {
      worst = std::max(worst, distance_to_surface(exact, hull.origin + Vec3(hull.vertices[i])));
    }
    for (std::size_t i = 0; i < exact.vertices.size(); i += 7) {
      worst = std::max(worst, distance_to_surface(hull, exact.origin + Vec3(exact.vertices[i])));
    }
    EXPECT_LE(worst, deviation * (1 + 1e-3));
    expect_right(hull, scene.views(), options, "simplified",
                 {.points = 10000, .deviation = deviation});
  }
}

template <class Break>
void expect_refused(const char* what, Break&& spoil) {
  HullScene scene = figure_scene(3, 24);
  HullOptions options = within(scene);
  spoil(scene, options);
  HullBuilder builder;
  EXPECT_THROW(builder.build(scene.views(), options), Error) << what;
  // A refusal leaves the builder usable.
  const HullScene good = figure_scene(3, 24);
  EXPECT_TRUE(same_bytes(builder.build(good.views()), build(good))) << what;
}

TEST(Hull, RefusesWhatIsNotFiniteOrDegenerate) {
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  expect_refused("R", [&](HullScene& s, HullOptions&) { s.rig.cameras[1].R[0][1] = nan; });
  expect_refused("t", [&](HullScene& s, HullOptions&) { s.rig.cameras[1].t.z = infinity; });
  expect_refused("K", [&](HullScene& s, HullOptions&) { s.rig.cameras[1].K[2][0] = nan; });
  expect_refused("focal length", [&](HullScene& s, HullOptions&) { s.rig.cameras[1].K[0][0] = 0; });
  expect_refused("far beyond float", [&](HullScene& s, HullOptions& o) {
    s.rig.cameras[1].t.z = 1e60;
    o.bounds.reset();
  });
  expect_refused("rotation", [&](HullScene& s, HullOptions&) { s.rig.cameras[1].R = Mat3(0.0); });
  expect_refused("contour",
                 [&](HullScene& s, HullOptions&) { s.silhouettes[0].points[3].x = std::nanf(""); });
  expect_refused("contour", [&](HullScene& s, HullOptions&) {
    s.silhouettes[0].points[3].y = std::numeric_limits<float>::infinity();
  });
  expect_refused("rays at right angles to the view", [&](HullScene& s, HullOptions&) {
    s.rig.cameras[1].K[0][0] = s.rig.cameras[1].K[1][1] = 2e-5;
  });
  // With silhouettes around the principal point, so that nothing else is amiss.
  expect_refused("focal lengths that differ by far", [&](HullScene& s, HullOptions&) {
    Camera& camera = s.rig.cameras[1];
    camera.K[0][0] = 1e-4;
    for (Vec2f& p : s.silhouettes[1].points) p.x = float(camera.K[2][0] + 1e-7 * (p.x - 512));
  });
  expect_refused("contour far to the side",
                 [&](HullScene& s, HullOptions&) { s.silhouettes[0].points[3].x = 1e9f; });
  expect_refused("bounds", [&](HullScene&, HullOptions& o) { o.bounds->max.x = nan; });
  expect_refused("bounds",
                 [&](HullScene&, HullOptions& o) { std::swap(o.bounds->min, o.bounds->max); });
  expect_refused("deviation", [&](HullScene&, HullOptions& o) { o.max_deviation = nan; });
  expect_refused("deviation", [&](HullScene&, HullOptions& o) { o.max_deviation = -1; });
  expect_refused("keep without bounds", [&](HullScene&, HullOptions& o) {
    o.unseen = Unseen::keep;
    o.bounds.reset();
  });
}

TEST(Hull, StatisticsCount) {
  const HullScene scene = figure_scene(5, 16);
  HullBuilder builder;
  builder.build(scene.views());
  const HullStatistics& statistics = builder.statistics();
  EXPECT_EQ(statistics.cameras, 5u);
  EXPECT_EQ(statistics.contour_vertices, scene.contour_vertices());
  EXPECT_GT(statistics.predicates, 1000u);
  EXPECT_LT(double(statistics.exact_predicates), 1e-3 * double(statistics.predicates))
      << "a generic scene";
}

}  // namespace
}  // namespace polyhull::test
