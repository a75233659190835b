// SPDX-License-Identifier: LGPL-2.1-or-later
// The judges of the hull are judged first: each check must pass a right mesh and catch a wrong one.
#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "support/degenerate_scenes.h"
#include "support/figure.h"
#include "support/membership.h"
#include "support/mesh_checks.h"
#include "support/scenes.h"

namespace polyhull::test {
namespace {

/// The box as a mesh with the bounds' six faces.
Hull box_mesh(const Bounds& box, const Vec3& origin) {
  Hull hull;
  hull.origin = origin;
  for (const Vec3& corner : corners_of(box)) hull.vertices.emplace_back(corner - origin);
  const std::uint32_t quads[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (std::uint32_t f = 0; f < 6; ++f) {
    const auto& q = quads[f];
    hull.faces.push_back({-1, f, 2 * f, 2});
    hull.triangles.insert(hull.triangles.end(), {q[0], q[1], q[2], q[0], q[2], q[3]});
    hull.loop_vertices.insert(hull.loop_vertices.end(), q, q + 4);
    hull.loop_ends.push_back(4 * (f + 1));
    hull.face_loop_ends.push_back(f + 1);
  }
  return hull;
}

const Bounds box{Vec3(-1, -2, 0), Vec3(2, 1, 1)};

TEST(MeshChecks, ABoxIsSound) {
  const MeshReport report = check_mesh(box_mesh(box, Vec3(5, 6, 7)));
  EXPECT_TRUE(report.sound()) << report.describe();
  EXPECT_NEAR(report.volume, 9.0, 1e-12);
  EXPECT_EQ(report.slivers, 0u);
  const PlaneReport planes = check_planes(box_mesh(box, Vec3(0.0)), {}, {box});
  EXPECT_EQ(planes.bad_source + planes.flipped + planes.wrong_side, 0u);
  EXPECT_EQ(planes.worst_distance, 0.0);
}

TEST(MeshChecks, FaultsAreFound) {
  Hull hull = box_mesh(box, Vec3(0.0));
  std::swap(hull.triangles[0], hull.triangles[1]);
  EXPECT_FALSE(check_mesh(hull).closed()) << "a triangle turned over";
  EXPECT_EQ(check_planes(hull, {}, {box}).flipped, 1u);

  hull = box_mesh(box, Vec3(0.0));
  hull.triangles.resize(hull.triangles.size() - 3);
  EXPECT_FALSE(check_mesh(hull).closed()) << "a triangle missing";

  hull = box_mesh(box, Vec3(0.0));
  hull.vertices.push_back(Vec3f(0));
  EXPECT_FALSE(check_mesh(hull).sound()) << "a vertex that nobody uses";

  hull = box_mesh(box, Vec3(0.0));
  hull.vertices[3].x = std::nanf("");
  EXPECT_FALSE(check_mesh(hull).sound()) << "not a number";

  hull = box_mesh(box, Vec3(0.0));
  hull.loop_vertices[1] = 0;
  EXPECT_FALSE(check_mesh(hull).inconsistency.empty())
      << "a loop that is not its triangles' boundary";

  hull = box_mesh(box, Vec3(0.0));
  hull.faces[2].triangle_count = 1;
  EXPECT_FALSE(check_mesh(hull).inconsistency.empty()) << "a face that lacks a triangle";

  hull = box_mesh(box, Vec3(0.0));
  hull.triangles[4] = 99;
  EXPECT_FALSE(check_mesh(hull).sound()) << "an index out of range";
}

TEST(MeshChecks, TwoBoxesThatShareAVertexAreNotManifold) {
  Hull hull = box_mesh({Vec3(0), Vec3(1)}, Vec3(0.0));
  const Hull other = box_mesh({Vec3(1), Vec3(2)}, Vec3(0.0));
  // Vertex 7 of the first box is vertex 0 of the second.
  const auto renamed = [](std::uint32_t v) { return v == 0 ? 7 : v + 7; };
  hull.vertices.insert(hull.vertices.end(), other.vertices.begin() + 1, other.vertices.end());
  for (std::uint32_t v : other.triangles) hull.triangles.push_back(renamed(v));
  const MeshReport report = check_mesh(hull);
  EXPECT_TRUE(report.closed());
  EXPECT_FALSE(report.manifold());
  EXPECT_EQ(report.split_vertices, 1u);
}

TEST(MeshChecks, FingerprintsTellMeshesApart) {
  const Hull hull = box_mesh(box, Vec3(0.0));
  Hull other = hull;
  EXPECT_TRUE(same_bytes(hull, other));
  EXPECT_EQ(fingerprint(hull), fingerprint(other));
  other.vertices[5].y = std::nextafter(other.vertices[5].y, 9.0f);
  EXPECT_FALSE(same_bytes(hull, other));
  EXPECT_NE(fingerprint(hull), fingerprint(other));
}

TEST(Membership, WindingOfABox) {
  const Hull hull = box_mesh(box, Vec3(5, 6, 7));
  const MeshMembership mesh(hull);
  EXPECT_EQ(mesh.winding(Vec3(0, 0, 0.5)), 1);
  EXPECT_EQ(mesh.winding(Vec3(0.5, -0.5, 0.5)), 1) << "straight below a diagonal";
  EXPECT_EQ(mesh.winding(Vec3(0, 0, 1.5)), 0);
  EXPECT_EQ(mesh.winding(Vec3(0, 0, -0.5)), 0);
  EXPECT_EQ(mesh.winding(Vec3(3, 0, 0.5)), 0);
  HullOptions options;
  options.bounds = box;
  const auto report = compare_membership(hull, {}, options, {Vec3(-3), Vec3(3)}, 100000, 1);
  EXPECT_EQ(report.wrong(), 0u);
  EXPECT_NEAR(report.volume, 9.0, 0.3);
  options.bounds->max.x += 0.1;
  EXPECT_GT(compare_membership(hull, {}, options, {Vec3(-3), Vec3(3)}, 100000, 1).missing, 0u);
  options.bounds->max.x -= 0.2;
  EXPECT_GT(compare_membership(hull, {}, options, {Vec3(-3), Vec3(3)}, 100000, 1).extra, 0u);
}

TEST(Membership, SilhouettesOfTwoCameras) {
  const Camera front = axis_camera("front", {0, 0, -4}, 5),
               side = axis_camera("side", {-4, 0, 0}, 1);
  Rings ring;
  add_ring(ring, {{256, 128}, {256, 640}, {768, 640}, {768, 128}});  // |x| < z/4 either way
  const Silhouette views[2] = {{&front, &ring}, {&side, &ring}};
  const SilhouetteMembership truth(views, {});
  EXPECT_EQ(truth.ask(Vec3(0.0)), SilhouetteMembership::inside);
  EXPECT_EQ(truth.ask(Vec3(0, 0.999, 0)), SilhouetteMembership::inside);
  EXPECT_EQ(truth.ask(Vec3(0, 1.001, 0)), SilhouetteMembership::outside);
  EXPECT_EQ(truth.ask(Vec3(0, 1, 0)), SilhouetteMembership::undecided) << "on the boundary";
  EXPECT_EQ(truth.ask(Vec3(0, 0, -5)), SilhouetteMembership::outside) << "behind a camera";
  EXPECT_EQ(truth.ask(Vec3(1.2, 0, 0.1)), SilhouetteMembership::outside);
  HullOptions keep;
  keep.unseen = Unseen::keep;
  EXPECT_EQ(SilhouetteMembership({views, 1}, keep).ask(Vec3(0, 0, -5)),
            SilhouetteMembership::inside);
  EXPECT_EQ(SilhouetteMembership({views, 1}, keep).ask(Vec3(0, 1.8, 0)),
            SilhouetteMembership::inside);
  EXPECT_EQ(SilhouetteMembership({views, 1}, keep).ask(Vec3(0, 1.2, 0)),
            SilhouetteMembership::outside);
}

TEST(Membership, ManyAnswersEqualSingleOnes) {
  const HullScene scene = figure_scene(5, 12);
  const auto views = scene.views();
  HullOptions options;
  options.bounds = scene.rig.bounds;
  const SilhouetteMembership truth(views, options);
  Dice dice(3);
  std::vector<Vec3> points(20000);
  for (Vec3& X : points)
    X = Vec3(dice.between(-1.3, 1.3), dice.between(-1.1, 1.1), dice.between(-1.3, 1.3));
  const auto answers = truth.ask(points);
  std::size_t inside = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(answers[i], truth.ask(points[i]));
    inside += answers[i] == SilhouetteMembership::inside;
  }
  EXPECT_GT(inside, 100u);
  EXPECT_LT(inside, 5000u);
}

TEST(Figure, SilhouetteOfASphere) {
  const Camera camera = axis_camera("c", {0, 0, -4}, 5);
  const Rings rings = silhouette_of({{Vec3(0.0), Vec3(0.0), 1.0}}, camera, 8);
  ASSERT_EQ(rings.size(), 1u);
  // The cone touches the sphere at sin(angle) = 1/4.
  const double radius = 1024 * std::tan(std::asin(0.25));
  double area = 0;
  for (std::size_t i = 0; i < rings.points.size(); ++i) {
    const Vec2 p(rings.points[i]), q(rings.points[(i + 1) % rings.points.size()]);
    EXPECT_NEAR(glm::length(p - Vec2(512, 384)), radius, 1.3)
        << "pushed off a node by at most 0.15 steps";
    area += (q.x * p.y - p.x * q.y) / 2;  // positive: counter-clockwise on screen
  }
  EXPECT_NEAR(area, M_PI * radius * radius, 0.01 * area);
}

TEST(Figure, WalksWithAHole) {
  std::size_t holes = 0;
  for (const Rings& rings : figure_scene(6, 4).silhouettes) holes += rings.size() - 1;
  EXPECT_GT(holes, 0u);
}

TEST(Scenes, TextComesBack) {
  HullScene scene = random_scene(5);
  for (Rings& rings : scene.silhouettes) orient_rings(rings);
  const HullScene again = parse_hull_scene(hull_scene_to_json(scene), "again");
  ASSERT_EQ(again.silhouettes.size(), scene.silhouettes.size());
  for (std::size_t i = 0; i < scene.silhouettes.size(); ++i) {
    EXPECT_EQ(again.silhouettes[i], scene.silhouettes[i]);
    EXPECT_EQ(again.rig.cameras[i].R, scene.rig.cameras[i].R);
    EXPECT_EQ(again.rig.cameras[i].t, scene.rig.cameras[i].t);
  }
  EXPECT_THROW(parse_hull_scene("{}", "x"), Error);
  EXPECT_THROW(parse_hull_scene("[1,", "x"), Error);
  EXPECT_THROW(load_hull_scene("/nowhere/scene.json"), Error);
}

TEST(Scenes, SeedsRepeat) {
  EXPECT_EQ(hull_scene_to_json(random_scene(17)), hull_scene_to_json(random_scene(17)));
  EXPECT_NE(hull_scene_to_json(random_scene(17)), hull_scene_to_json(random_scene(18)));
}

TEST(Scenes, RandomRegionsAreOriented) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    Dice dice(seed);
    const Rings rings = random_region(dice, Vec2(500, 400), 100);
    Rings oriented = rings;
    orient_rings(oriented);
    EXPECT_EQ(rings, oriented) << "seed " << seed;
  }
}

}  // namespace
}  // namespace polyhull::test
