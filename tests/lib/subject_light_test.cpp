// SPDX-License-Identifier: LGPL-2.1-or-later
// The scene's light on subjects: against formulas for a lamp and a wall, against many rays for a soft
// shadow's border, and which of its nodes are found anew.
#include "render/subject_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <random>

#include "backend.h"
#include "raytrace/traced_scene.h"
#include "render/light_samples.h"
#include "shot.h"
#include "synthetic.h"

namespace polyhull {
namespace {

using synthetic::floor_scene;
using synthetic::plain_box;
using synthetic::point_lamp;
using synthetic::Shot;

constexpr Vec3 middle(0, 1, 0);  // of the stage

/// A rectangle around \p centre, spanned by \p u and \p v.
SceneMesh wall(const Vec3f& centre, const Vec3f& u, const Vec3f& v) {
  SceneMesh out;
  out.positions = {centre - u - v, centre + u - v, centre + u + v, centre - u + v};
  out.normals.assign(4, glm::normalize(glm::cross(u, v)));
  out.triangles = {0, 1, 2, 0, 2, 3};
  return out;
}

/// What scatters nothing.
Material black() {
  Material out;
  out.base_colour = Vec3f(0.0f);
  return out;
}

double over_square(const Vec3& from, const Vec3& to) {
  const Vec3 way = to - from;
  return 1.0 / glm::dot(way, way);
}

using SubjectLightPictureTest = testing::BackendTest;

// A grey box comes out as many times brighter as the lamp is nearer, and the half that a wall keeps from
// the lamp has the ambient light alone.
TEST_P(SubjectLightPictureTest, FallsWithTheDistanceAndInTheWallsShadow) {
  const Vec3 lamp(0.0, 1.2, 3.0);
  const Vec3f power(6.0f, 5.0f, 4.0f), ambient(0.25f, 0.1f, 0.05f);
  for (const bool shadowed : {false, true}) {
    Scene scene = floor_scene(black(), point_lamp(Vec3f(lamp), power));
    // Keeps all that lies at x < -0.25, some way behind it, from the lamp, and the stage's middle not.
    if (shadowed) scene.meshes.push_back(wall({-1.06f, 1.2f, 2.5f}, {1.0f, 0, 0}, {0, 1.2f, 0}));
    const Mesh box = plain_box({-0.9f, 0.1f, -0.6f}, {0.9f, 0.9f, 0.2f}, 0.5f);
    Shot shot(scene, box, synthetic::look_at({0, 1.0, 2.4}, {0, 0.5, 0}, 320, 240, 50.0));
    shot.frame.ambient = ambient;
    shot.settings.shadow = ShadowQuality::off;
    shot.settings.mirror = MirrorMode::off;
    shot.frame.subjects[0].lighting = SubjectLighting::shade;
    shot.draw(0.2f);
    const double grey = synthetic::to_linear(0.5f);
    for (const Vec3& point : {Vec3(0.6, 0.3, 0.2), Vec3(0.3, 0.7, 0.2), Vec3(-0.7, 0.5, 0.2)}) {
      const bool dark = shadowed && point.x < 0;
      const Vec3f found = shot.at(point);
      for (int c = 0; c < 3; ++c) {
        const double lit = dark ? 0.0 : power[c] * over_square(point, lamp) / 4.0;
        const double expected =
            grey * (ambient[c] + lit) / (ambient[c] + power[c] * over_square(middle, lamp) / 4.0);
        EXPECT_NEAR(found[c], expected, 0.01) << point.x << " channel " << c << " " << shadowed;
      }
    }
    // Without it all is grey.
    shot.frame.subjects[0].lighting = SubjectLighting::off;
    shot.draw(0.2f);
    EXPECT_NEAR(shot.at({0.6, 0.3, 0.2}).x, grey, 0.003);
  }
}

INSTANTIATE_TEST_SUITE_P(Api, SubjectLightPictureTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

/// A subject in a scene, without a picture.
struct Stage {
  Mesh mesh;
  RenderFrame frame;
  std::unique_ptr<TracedScene> traced;
  SubjectLight light;

  Stage(Scene scene, const Vec3f& low, const Vec3f& high) : mesh(plain_box(low, high, 0.5f)) {
    frame.width = 320, frame.height = 240;
    frame.viewport = synthetic::look_at({0, 1, 6}, {0, 0.5, 0}, 320, 240, 60.0);
    frame.lights = scene.lights;
    frame.scene = std::make_shared<const Scene>(std::move(scene));
    traced = std::make_unique<TracedScene>(*frame.scene);
    frame.subjects.push_back({&mesh, {}, 0, nullptr, SubjectLighting::shade});
  }
  std::shared_ptr<const LightLattice> find() {
    const RenderPlan plan = plan_frame(frame, {}, scene_bounds(*frame.scene));
    return light.around(plan.subjects.at(0), frame, *traced);
  }
};

// Who dims or colours the lamp does it to the subject, and to the light that comes with it.
TEST(SubjectLight, FollowsTheLampsBrightness) {
  const Vec3f lamp(0.0f, 3.0f, 0.0f);
  Material grey;
  grey.base_colour = Vec3f(0.5f);
  Stage stage(floor_scene(grey, point_lamp(lamp, Vec3f(6.0f))), {-0.3f, 0.6f, -0.3f},
              {0.3f, 1.4f, 0.3f});
  stage.frame.ambient = Vec3f(1.0f);
  const auto factor = [&] {
    const auto lattice = stage.find();
    return lattice->at((Vec3f(middle) - lattice->origin) / lattice->cell);
  };
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(factor()[c], 1.0f, 0.02f);
  const Vec3f dimmed(0.5f, 0.25f, 0.0f);
  stage.frame.undimmed = stage.frame.lights;
  stage.frame.lights[0].radiance *= dimmed;
  stage.frame.ambient *= dimmed;
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(factor()[c], dimmed[c], 0.02f) << c;
}

Scene lit_by_area(const Vec3f& centre) {
  Light lamp = point_lamp(centre, Vec3f(20.0f));
  lamp.u = {0.3f, 0, 0};
  lamp.v = {0, 0, 0.3f};  // down
  return floor_scene(black(), lamp);
}

// Far below a lamp a floor sends up what it scatters: at its end there is less of that.
TEST(SubjectLight, HasTheLightThatSurfacesScatter) {
  Material red;
  red.base_colour = {0.8f, 0.2f, 0.1f};
  Stage stage(floor_scene(red, point_lamp({0, 3000, 0}, Vec3f(9e6f))), {2.9f, 0.1f, -0.3f},
              {4.6f, 1.8f, 0.3f});
  const auto lattice = stage.find();
  ASSERT_TRUE(lattice);
  std::mt19937 random(5);
  std::normal_distribution<float> any(0.0f, 1.0f);
  const auto light = [&](const Vec3f& point,
                         int channel) {  // by its irradiance from straight above
    int met = 0;
    constexpr int rays = 4000;
    for (int i = 0; i < rays; ++i)
      met +=
          stage.traced->caster().occluded({point, 0.0f, {any(random), any(random), any(random)}});
    return 0.25 + red.base_colour[channel] * met / rays;
  };
  for (const Vec3f& point : {Vec3f(3.0f, 0.4f, 0), Vec3f(3.7f, 1.0f, 0), Vec3f(4.4f, 0.6f, 0.2f)}) {
    const Vec3f found = lattice->at((point - lattice->origin) / lattice->cell);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(found[c], light(point, c) / light(Vec3f(middle), c), 0.07) << point.x << " " << c;
  }
}

// Beside furniture, in which some of the points are that the light is found at, it is as bright as
// elsewhere.
TEST(SubjectLight, IsNotDarkerBesideFurniture) {
  const Vec3 lamp(0, 6, 0);
  Scene scene = floor_scene(black(), point_lamp(Vec3f(lamp), Vec3f(30.0f)));
  Hull cupboard;
  synthetic::add_box(cupboard, {0.53f, 0.0f, -0.5f}, {1.2f, 1.03f, 0.5f});
  SceneMesh mesh;
  mesh.positions = cupboard.vertices;
  mesh.triangles = cupboard.triangles;
  for (const Vec3f& p : mesh.positions)
    mesh.normals.push_back(glm::normalize(p - Vec3f(0.86f, 0.5f, 0)));
  scene.meshes.push_back(mesh);
  Stage stage(std::move(scene), {0.1f, 0.05f, -0.3f}, {0.9f, 1.6f, 0.3f});
  const auto lattice = stage.find();
  ASSERT_TRUE(lattice);
  for (const Vec3f& point :
       {Vec3f(0.51f, 0.9f, 0), Vec3f(0.5f, 0.5f, 0.1f), Vec3f(0.8f, 1.05f, 0)}) {
    const double expected = over_square(Vec3(point), lamp) / over_square(middle, lamp);
    const Vec3f found = lattice->at((point - lattice->origin) / lattice->cell);
    EXPECT_NEAR(found.x, expected, 0.06) << point.x << " " << point.y;
  }
}

// Across the soft border of a shadow the lattice is where a thousand rays say.
TEST(SubjectLight, FollowsASoftBorder) {
  Scene scene = lit_by_area({0, 2.6f, 0});
  scene.lights[0].v = -scene.lights[0].v;
  if (light_normal(scene.lights[0]).y > 0) scene.lights[0].u = -scene.lights[0].u;
  ASSERT_LT(light_normal(scene.lights[0]).y, -0.99f);
  scene.meshes.push_back(wall({-1.45f, 1.8f, 0}, {0, 0, 1.0f}, {1.0f, 0, 0}));
  Stage stage(std::move(scene), {-0.9f, 0.05f, -0.4f}, {0.5f, 1.6f, 0.4f});
  const auto lattice = stage.find();
  ASSERT_TRUE(lattice);
  const Light& lamp = stage.frame.lights[0];
  std::mt19937 random(5);
  std::uniform_real_distribution<float> share(-1.0f, 1.0f), unit(0.0f, 1.0f);
  const auto irradiance = [&](const Vec3f& point) {
    double sum = 0.0;
    constexpr int rays = 1024;
    for (int i = 0; i < rays; ++i) {
      const Vec3f way = lamp.centre + share(random) * lamp.u + share(random) * lamp.v - point;
      if (stage.traced->caster().occluded({point, 0.0f, way, 0.9999f})) continue;
      const float square = glm::dot(way, way);
      sum += std::max(0.0f, way.y / std::sqrt(square)) / (4.0f * square);
    }
    return sum / rays;
  };
  const double reference = irradiance(Vec3f(middle));
  double squares = 0.0;
  int borders = 0;
  constexpr int points = 400;
  for (int i = 0; i < points; ++i) {
    const Vec3f point(-0.9f + 1.4f * unit(random), 0.05f + 1.55f * unit(random),
                      -0.4f + 0.8f * unit(random));
    const double expected = irradiance(point) / reference;
    const double found = lattice->at((point - lattice->origin) / lattice->cell).x;
    squares += (found - expected) * (found - expected);
    borders += expected > 0.05 && expected < 0.4;
  }
  EXPECT_GT(borders, 20);
  EXPECT_LT(std::sqrt(squares / points), 0.03);
}

TEST(SubjectLight, AWalkFindsFewNewNodesAndAnotherLightAll) {
  Stage stage(floor_scene({}, point_lamp({0, 2.5f, 1}, Vec3f(5.0f))), {-0.4f, 0, -0.4f},
              {0.4f, 1.8f, 0.4f});
  const auto still = stage.find();
  ASSERT_TRUE(still);
  const std::size_t all = stage.light.found();
  EXPECT_GT(all, 300u);
  EXPECT_EQ(stage.find(), still) << "and its lattice is the same, which need not be uploaded anew";
  EXPECT_EQ(stage.light.found(), 0u);
  stage.frame.subjects[0].placement.translate.x = 0.125;
  const auto bright = stage.find();
  EXPECT_GT(stage.light.found(), 0u);
  EXPECT_LT(stage.light.found(), all / 4);
  stage.frame.lights[0].radiance *= 0.5f;
  const auto dimmed = stage.find();
  EXPECT_EQ(stage.light.found(), all);
  // The stage's middle is dimmed with it.
  ASSERT_EQ(dimmed->factors.size(), bright->factors.size());
  for (std::size_t i = 0; i < dimmed->factors.size(); ++i)
    ASSERT_NEAR(dimmed->factors[i].x, bright->factors[i].x, 1e-6f);
}

// The light of a place does not jump when the subject's box grows by a node, and a platform that its
// lowest point lies in by 3 cm darkens nothing.
TEST(SubjectLight, StaysTheSameWhileTheSubjectGrows) {
  Scene scene = floor_scene({}, point_lamp({0, 2.5f, 0}, Vec3f(5.0f)));
  scene.meshes.push_back(wall({-1.2f, 1.6f, 0}, {0, 0, 1.0f}, {0.8f, 0, 0}));
  scene.meshes.push_back(wall({0, 0.1f, 0}, {0, 0, 1.5f}, {1.5f, 0, 0}));
  std::vector<Vec3f> before;
  for (int step = 0; step < 40; ++step) {
    const float grown = 0.01f * static_cast<float>(step);
    Stage stage(scene, {-0.5f - grown, 0.11f - 0.1f * grown, -0.3f}, {0.4f, 1.7f, 0.3f});
    const auto lattice = stage.find();
    ASSERT_TRUE(lattice);
    std::vector<Vec3f> now;
    for (const Vec3f& place :
         {Vec3f(-0.5f, 0.5f, 0), Vec3f(-0.4f, 1.2f, 0.1f), Vec3f(0.2f, 0.12f, 0)})
      now.push_back(lattice->at((place - lattice->origin) / lattice->cell));
    for (std::size_t i = 0; i < before.size(); ++i) {
      EXPECT_NEAR(now[i].x, before[i].x, 0.01f) << step << " place " << i;
    }
    EXPECT_GT(now[2].x, 0.05f) << step;
    before = now;
  }
}

TEST(SubjectLight, IsNullWhereNothingIsLit) {
  Stage stage(floor_scene({}, point_lamp({0, 2.5f, 1}, Vec3f(0.0f))), {-0.4f, 0, -0.4f},
              {0.4f, 1.8f, 0.4f});
  EXPECT_FALSE(stage.find());
  stage.frame.ambient = Vec3f(0.2f, 0.0f, 0.2f);
  const auto ambient = stage.find();
  ASSERT_TRUE(ambient);
  for (const Vec3f& factor : ambient->factors) EXPECT_EQ(factor, Vec3f(1.0f));
}

// Subjects of a kilometre, or as far away as may be, have no more nodes than one of a few metres.
TEST(SubjectLight, LargeFarAndThinSubjects) {
  const Scene scene = floor_scene({}, point_lamp({0, 2.5f, 1}, Vec3f(5.0f)));
  const std::vector<std::pair<Vec3f, Vec3f>> boxes = {
      {{-500, 0, -500}, {500, 900, 500}},
      {{9.99e8f, 0, -9.99e8f}, {9.9901e8f, 2, -9.98e8f}},
      {{-0.01f, 0.01f, 0}, {0.01f, 0.02f, 0.001f}}};
  for (const auto& [low, high] : boxes) {
    Stage stage(scene, low, high);
    const auto lattice = stage.find();
    ASSERT_TRUE(lattice);
    EXPECT_LT(lattice->factors.size(), 35u * 35u * 35u);
    for (const Vec3f& factor : lattice->factors) ASSERT_TRUE(std::isfinite(factor.x));
    const float nan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(lattice->at({nan, nan, nan}), lattice->at({0, 0, 0}));
  }
}

}  // namespace
}  // namespace polyhull
