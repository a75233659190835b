// SPDX-License-Identifier: LGPL-2.1-or-later
// Where a subject stands in a scene: its rig's unit and up, and the user's placement.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "render/frame.h"
#include "render/projection.h"
#include "render/shadow_lights.h"

namespace polyhull {
namespace {

/// A box of three different sides, 1 by 2 by 3, that begins at \p low.
Mesh box_at(const Vec3& low, double unit = 1.0) {
  Mesh mesh;
  mesh.metres_per_unit = unit;
  mesh.hull.origin = low / unit;
  for (int i = 0; i < 8; ++i)
    mesh.hull.vertices.emplace_back(i & 1 ? 1 / unit : 0, i & 2 ? 2 / unit : 0,
                                    i & 4 ? 3 / unit : 0);
  return mesh;
}

void expect_at(const Mat4& place, const Vec3& from, const Vec3& to) {
  const Vec3 found(place * Vec4(from, 1.0));
  EXPECT_LT(glm::length(found - to), 1e-6) << found.x << " " << found.y << " " << found.z << " for "
                                           << to.x << " " << to.y << " " << to.z;
}

TEST(Placement, EveryUnitGivesTheSameMetres) {
  for (const double unit : {1.0, 0.01, 0.001, 0.0254, 0.3048, 0.37, 5.0}) {
    const Mat4 place = place_in_scene(box_at({1, 0, -2}, unit), {});
    expect_at(place, Vec3(1, 0, -2) / unit, {1, 0, -2});
    expect_at(place, Vec3(2, 2, 1) / unit, {2, 2, 1});
  }
}

TEST(Placement, TheRigsUpBecomesY) {
  for (const Vec3& up : {Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(0, 0, -3), Vec3(1, 0, 0),
                         Vec3(0, -1, 0), Vec3(1, 2, -2)}) {
    Mesh mesh = box_at({0, 0, 0});
    mesh.up = up;
    const Mat4 place = place_in_scene(mesh, {});
    expect_at(place, glm::normalize(up), {0, 1, 0});
    EXPECT_NEAR(glm::determinant(Mat3(place)), 1.0, 1e-9);
  }
}

TEST(Placement, MovesTurnsAndScalesAboutTheCentre) {
  const Mesh mesh = box_at({1, 0, 0});
  const Vec3 centre(1.5, 1, 1.5);
  const auto about_box = [](SubjectPlacement placement) {
    placement.pivot = Pivot::box;
    return placement;
  };
  expect_at(place_in_scene(mesh, about_box({{0.5, 1, -2}, Vec3(0), 1.0})), {1, 0, 0}, {1.5, 1, -2});
  expect_at(place_in_scene(mesh, about_box({Vec3(0), Vec3(0), 2.0})), centre, centre);
  expect_at(place_in_scene(mesh, about_box({Vec3(0), Vec3(0), 2.0})), {2, 2, 3},
            centre + Vec3(1, 2, 3));
  const Vec3 x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  expect_at(place_in_scene(mesh, about_box({Vec3(0), {90, 0, 0}, 1.0})), centre + y, centre + z);
  expect_at(place_in_scene(mesh, about_box({Vec3(0), {0, 90, 0}, 1.0})), centre + z, centre + x);
  expect_at(place_in_scene(mesh, about_box({Vec3(0), {0, 0, 90}, 1.0})), centre + x, centre + y);
  // About x first, then y, then z.
  expect_at(place_in_scene(mesh, about_box({Vec3(0), {90, 90, 0}, 1.0})), centre + y, centre + x);
  expect_at(place_in_scene(mesh, about_box({{0, 3, 0}, {90, 90, 90}, 2.0})), centre + y,
            centre + Vec3(0, 3, 0) + 2.0 * y);
}

// What stands on the floor stands there when it has been scaled and turned, with arms up or down; a
// walk along x becomes one along z.
TEST(Placement, AboutTheRigsOriginFeetStayOnTheFloor) {
  for (const double reach : {0.0, 0.7}) {
    Mesh mesh = box_at({1, 0, 0});
    for (Vec3f& v : mesh.hull.vertices)
      if (v.y > 1.0f) v.y += static_cast<float>(reach);
    for (const double scale : {0.5, 1.0, 3.0}) {
      SubjectPlacement placement;
      placement.rotate.y = 90.0;
      placement.scale = scale;
      const Mat4 place = place_in_scene(mesh, placement);
      expect_at(place, {1, 0, 0}, {0, 0, -scale});
      expect_at(place, {2, 0, 3}, {3 * scale, 0, -2 * scale});
    }
  }
  // In a rig of millimetres that stands elsewhere, too.
  SubjectPlacement doubled;
  doubled.scale = 2.0;
  expect_at(place_in_scene(box_at({1, 0, 0}, 0.001), doubled), {1000, 0, 0}, {2, 0, 0});
}

TEST(Placement, TurnsAboutThePointAndTheCentreOfGravity) {
  Mesh mesh = box_at({1, 0, 0});
  mesh.hull.triangles = {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                         2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};
  SubjectPlacement placement;
  placement.rotate.y = 180.0;
  placement.pivot = Pivot::point;
  placement.pivot_point = {1, 5, 0};
  expect_at(place_in_scene(mesh, placement), {2, 0, 1}, {0, 0, -1});
  placement.pivot = Pivot::centroid;
  expect_at(place_in_scene(mesh, placement), {1, 0, 0}, {2, 0, 3});
  // Gravity, not the box: a spike of no weight does not move it.
  const auto tip = static_cast<std::uint32_t>(mesh.hull.vertices.size());
  mesh.hull.vertices.emplace_back(0, 0, 30);
  mesh.hull.triangles.insert(mesh.hull.triangles.end(), {0, tip, 0, 0, 0, tip});
  expect_at(place_in_scene(mesh, placement), {1, 0, 0}, {2, 0, 3});
  mesh.hull.triangles.clear();  // no volume
  EXPECT_NO_THROW(place_in_scene(mesh, placement));
}

TEST(Projection, AResizedCameraSeesTheSame) {
  Camera camera;
  camera.width = 640;
  camera.height = 360;
  camera.K = from_rows({500, 3, 310, 0, 510, 190, 0, 0, 1});
  const Camera half = resized(camera, 320, 90);
  const Vec3 point(0.3, -0.2, 2.0);
  const Vec2 full = camera.project_ideal(point).value(), small = half.project_ideal(point).value();
  // Edges of pixels stay edges of pixels.
  EXPECT_NEAR(small.x + 0.5, (full.x + 0.5) / 2, 1e-9);
  EXPECT_NEAR(small.y + 0.5, (full.y + 0.5) / 4, 1e-9);
}

TEST(Projection, ReflectsAtThePlane) {
  const Mat4 mirror = reflection(glm::normalize(Vec3(1, 1, 0)), std::sqrt(2.0));
  expect_at(mirror, {0, 0, 5}, {2, 2, 5});
  expect_at(mirror, {2, 2, 5}, {0, 0, 5});
  expect_at(mirror, {0.5, 1.5, 1}, {0.5, 1.5, 1});
}

TEST(Projection, RectanglesHoldThePointsAndOnePixelMore) {
  Camera camera;
  camera.width = 200;
  camera.height = 100;
  camera.K = from_rows({100, 0, 99.5, 0, 100, 49.5, 0, 0, 1});
  // Pixels of the points: (49.5, 29.5) and (119.5, 69.5).
  const std::vector<Vec3f> points{{-0.5f, -0.2f, 1.0f}, {0.4f, 0.4f, 2.0f}};
  const Rectangle r = screen_rectangle(points, clip_from_camera(camera, 0.1, 10.0), 200, 100);
  EXPECT_TRUE(r.x <= 49 && r.x >= 47 && r.y <= 29 && r.y >= 27) << r.x << " " << r.y;
  EXPECT_TRUE(r.x + r.width >= 121 && r.x + r.width <= 123) << r.x + r.width;
  EXPECT_TRUE(r.y + r.height >= 71 && r.y + r.height <= 73) << r.y + r.height;
}

TEST(ShadowLights, ThoseThatGiveMostAreFirst) {
  Light far, near, away;
  far.centre = {0, 10, 0};
  far.radiance = Vec3f(30.0f);
  near.centre = {0, 2, 0};
  near.radiance = Vec3f(2.0f);
  away.centre = {0, 1, 0};  // shines up
  away.u = {0, 0, 1};
  away.v = {1, 0, 0};
  away.radiance = Vec3f(90.0f);
  const auto found = [](const std::vector<Light>& lights, double y, bool all = false) {
    std::vector<std::size_t> numbers;
    double shares = 0.0;
    const Bounds box{Vec3(-0.1, y - 0.1, -0.1), Vec3(0.1, y + 0.1, 0.1)};
    for (const ShadowLight& light : find_shadow_lights(lights, 1.0f, box, all)) {
      numbers.push_back(light.light);
      shares += light.share;
    }
    EXPECT_NEAR(shares, numbers.empty() ? 0.0 : 1.0, 1e-6);
    return numbers;
  };
  using Numbers = std::vector<std::size_t>;
  EXPECT_EQ(found({far, near, away}, 0), (Numbers{1, 0}));
  EXPECT_EQ(found({far, away}, 0), Numbers{0});
  EXPECT_EQ(found({away}, 0), Numbers{});
  EXPECT_EQ(found({away}, 0, true), Numbers{0});
  EXPECT_EQ(found({far, away}, 2), (Numbers{1, 0}));
}

// What is left out changes no pixel, however many lights there are of it; what a lamp can do at its
// nearest counts, and its middle says nothing of that.
TEST(ShadowLights, LeaveOutWhatCannotBeSeen) {
  const Bounds box{Vec3(-0.4, 0, -0.4), Vec3(0.4, 2, 0.4)};
  std::vector<Light> lights(1000);
  for (std::size_t i = 0; i < lights.size(); ++i) {
    lights[i].centre = Vec3f(0, 5, 0);  // 3 m over the box
    lights[i].radiance = Vec3f(static_cast<float>(0.99e-6 * 9.0 * std::numbers::pi));
  }
  // Each takes a picture value of .99e-6 at most: ten of them may go.
  EXPECT_EQ(find_shadow_lights(lights, 1.0f, box, false).size(), 990u);
  EXPECT_EQ(find_shadow_lights(lights, 0.0099f, box, false).size(), 0u);
  lights.resize(1);
  EXPECT_TRUE(find_shadow_lights(lights, 9.0f, box, false).empty());
  EXPECT_EQ(find_shadow_lights(lights, 11.0f, box, false).size(), 1u);
  lights[0].centre.y = 2.01f;
  EXPECT_EQ(find_shadow_lights(lights, 1.0f, box, false).size(), 1u);
  // A spot beside the box, whose cone may just reach it.
  Light spot;
  spot.centre = {4, 1, 0};
  spot.u = {0.1f, 0, 0};
  spot.v = {0, 0, 0.1f};  // down
  spot.radiance = Vec3f(100.0f);
  spot.inner_cone = 0.2f;
  for (const float outer : {0.4f, 0.9f, 1.2f, 1.5f}) {
    spot.outer_cone = outer;
    const double aside = std::numbers::pi / 2 - std::asin(1.35 / 4.0);
    EXPECT_EQ(find_shadow_lights(std::vector<Light>{spot}, 1.0f, box, false).size(),
              outer > aside ? 1u : 0u)
        << outer;
  }
}

// A hull's vertices are told from its origin.
TEST(Plan, PutsTheHullWhereItsOriginIs) {
  Mesh mesh = box_at({4, 1, -2}, 0.01);
  mesh.hull.triangles = {0, 1, 2};
  RenderFrame frame;
  frame.width = frame.height = 64;
  frame.subjects.push_back({&mesh, {{0.5, 0, 0}, Vec3(0), 1.0}, 0});
  frame.viewport = look_at({4, 1, 6}, {4, 1, 0}, 50, 64, 64);
  const RenderPlan plan = plan_frame(frame, {}, {});
  ASSERT_EQ(plan.subjects.size(), 1u);
  const Bounds bounds = bounds_of(plan.subjects[0].points);
  EXPECT_LT(glm::length(bounds.min - Vec3(4.5, 1, -2)), 1e-5);
  EXPECT_LT(glm::length(bounds.max - Vec3(5.5, 3, 1)), 1e-5);
  expect_at(plan.subjects[0].local_to_scene, {0, 0, 0}, {4.5, 1, -2});
  expect_at(plan.subjects[0].from_scene, {4.5, 1, -2}, mesh.hull.origin);
}

// Very many lights in a large picture: the strongest that there is memory for, skipping or not.
TEST(Plan, DrawsAsManyLightsAsItCanKeep) {
  Mesh mesh = box_at({-0.5, 0, -1.5});
  mesh.hull.triangles = {0, 1, 2};
  auto room = std::make_shared<Scene>();
  room->meshes.resize(1);
  RenderFrame frame;
  frame.scene = room;
  frame.width = 1920;
  frame.height = 1080;
  frame.subjects.push_back({&mesh, {}, 0});
  frame.viewport = look_at({0, 1.5, 6}, {0, 0.5, 0}, 50, 1920, 1080);
  for (int i = 0; i < 40; ++i) {
    Light lamp;
    lamp.centre = {0.1f * static_cast<float>(i % 7), 4.0f, 1.0f};
    lamp.radiance = Vec3f(1.0f + static_cast<float>(i));
    frame.lights.push_back(lamp);
  }
  const Bounds scene{Vec3(-3, 0, -3), Vec3(3, 4, 3)};
  RenderSettings settings;
  for (const bool skip : {true, false}) {
    settings.skip = skip;
    const RenderPlan plan = plan_frame(frame, settings, scene);
    ASSERT_EQ(plan.lights.size(), 15u);
    EXPECT_EQ(plan.lights_skipped, 25u);
    for (const ShadowLight& light : plan.lights) EXPECT_GE(light.light, 25u);
  }
  frame.width = 640;
  frame.height = 360;
  frame.viewport = look_at({0, 1.5, 6}, {0, 0.5, 0}, 50, 640, 360);
  EXPECT_EQ(plan_frame(frame, settings, scene).lights.size(), 40u);
}

// Mirrors show subjects from their front, where those are in their frame; of many, the largest count.
TEST(Plan, FindsTheMirrorsThatShowSubjects) {
  auto scene = std::make_shared<Scene>();
  const auto mirror = [&](float half, float height) {
    Mirror m;
    m.offset = height;
    m.outline = {
        {-half, height, half}, {half, height, half}, {half, height, -half}, {-half, height, -half}};
    scene->mirrors.push_back(m);
  };
  mirror(0.4f, 0.0f);
  mirror(3.0f, 0.0f);
  mirror(0.3f, 0.0f);
  SceneMesh floor;
  floor.positions = {{-3, 0, 3}, {3, 0, 3}, {3, 0, -3}};
  floor.triangles = {0, 1, 2};
  scene->meshes = {floor};
  Mesh mesh = box_at({-0.5, 0, -1.5});
  mesh.hull.triangles = {0, 1, 2};
  RenderFrame frame;
  frame.width = 320;
  frame.height = 240;
  frame.scene = scene;
  frame.subjects.push_back({&mesh, {}, 0});
  frame.viewport = look_at({0, 1.5, 6}, {0, 0.5, 0}, 50, 320, 240);
  const auto shown = [&] {
    std::vector<std::size_t> out;
    const RenderPlan plan = plan_frame(frame, {}, bounds_of(floor.positions));
    for (const SeenMirror& seen : plan.mirrors)
      if (!seen.image.empty()) out.push_back(seen.way.back());
    EXPECT_EQ(plan.mirrors_skipped, scene->mirrors.size() - out.size());
    return out;
  };
  EXPECT_EQ(shown(), (std::vector<std::size_t>{0, 1, 2}));
  // A tile beside all ways to the subject, though the rectangles of their images meet.
  scene->mirrors[2].outline = {
      {0.68f, 0, -0.9f}, {0.75f, 0, -0.9f}, {0.75f, 0, -1.05f}, {0.68f, 0, -1.05f}};
  EXPECT_EQ(shown(), (std::vector<std::size_t>{0, 1}));
  for (int i = 0; i < 9; ++i) mirror(0.6f + 0.1f * static_cast<float>(i % 5), 0.0f);
  EXPECT_EQ(shown().size(), most_mirrors);
  EXPECT_EQ(shown().front(), 1u);
  frame.viewport = look_at({0, -1.5, 6}, {0, 0.5, 0}, 50, 320, 240);
  EXPECT_TRUE(shown().empty());
}

}  // namespace
}  // namespace polyhull
