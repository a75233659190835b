// SPDX-License-Identifier: LGPL-2.1-or-later
// The scene's light on subjects by the way they face: against formulas and many rays, and in pictures of
// both renderers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "backend.h"
#include "raytrace/traced_scene.h"
#include "render/light_lattice.h"
#include "render/light_samples.h"
#include "render/subject_light.h"
#include "shot.h"
#include "texture/texture_hull.h"

namespace polyhull {
namespace {

using synthetic::floor_scene;
using synthetic::plain_box;
using synthetic::point_lamp;
using synthetic::Shot;

Material of_colour(const Vec3f& colour) {
  Material out;
  out.base_colour = colour;
  return out;
}

/// The light around a box of a metre and a half, and what it is made of.
struct Stage {
  Mesh mesh = plain_box({-0.5f, 0.3f, -0.5f}, {0.5f, 1.8f, 0.5f}, 0.5f);
  RenderFrame frame;
  std::unique_ptr<TracedScene> traced;
  SubjectLight light;
  std::shared_ptr<const LightLattice> lattice;

  explicit Stage(Scene scene, const Vec3f& ambient = Vec3f(0.0f)) {
    frame.width = 320, frame.height = 240;
    frame.viewport = synthetic::look_at({0, 1, 6}, {0, 0.5, 0}, 320, 240, 60.0);
    frame.lights = scene.lights;
    frame.ambient = ambient;
    frame.scene = std::make_shared<const Scene>(std::move(scene));
    traced = std::make_unique<TracedScene>(*frame.scene);
    frame.subjects.push_back({&mesh, {}, 0, nullptr, SubjectLighting::relit});
    frame.subjects.back().relight = 1.0f;
    const RenderPlan plan = plan_frame(frame, {}, scene_bounds(*frame.scene));
    lattice = light.around(plan.subjects.at(0), frame, *traced);
  }
  Vec3f form(const Vec3f& place, const Vec3f& normal) const {
    return find_form(*lattice, {&place, 1}, {&normal, 1}, 1.0f, {})[0];
  }
};

const Vec3f places[] = {{0.3f, 1.7f, -0.2f}, {-0.41f, 0.5f, 0.27f}, {0, 1, 0}};
const Vec3f normals[] = {{0, 1, 0},       {0, -1, 0},       {1, 0, 0},       {0, 0, -1},
                         {0.6f, 0.8f, 0}, {0, -0.6f, 0.8f}, {-0.8f, 0.6f, 0}};

// Below a lamp before a black floor: what faces it, what it grazes, what turns away.
TEST(Relight, IsLambertsOfALampAndTheAmbientLight) {
  const Vec3f lamp(0.4f, 2.6f, 0.2f), power(3.0f, 2.0f, 1.0f), ambient(0.05f, 0.1f, 0.15f);
  const Stage stage(floor_scene(of_colour(Vec3f(0.0f)), point_lamp(lamp, power)), ambient);
  for (const Vec3f& place : places)
    for (const Vec3f& normal : normals) {
      const Vec3f way = lamp - place;
      const float square = glm::dot(way, way);
      const float cosine = std::max(glm::dot(way, normal) / std::sqrt(square), 0.0f);
      const Vec3f found = stage.form(place, normal);
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(
            found[c],
            (ambient[c] + power[c] * cosine / square) / (ambient[c] + power[c] / (4.0f * square)),
            0.03f)
            << place.y << " " << normal.x << " " << normal.y << " channel " << c;
    }
}

// Close below a large lamp, which is seen from its middle and from its ends in other directions.
TEST(Relight, ALargeLampIsNoPoint) {
  Light lamp = point_lamp({0.2f, 2.4f, 0}, Vec3f(4.0f));
  lamp.u = {0.9f, 0, 0};
  lamp.v = {0, 0, 0.6f};
  ASSERT_LT(light_normal(lamp).y, -0.99f);
  const Stage stage(floor_scene(of_colour(Vec3f(0.0f)), lamp));
  std::mt19937 random(3);
  std::uniform_real_distribution<float> share(-1.0f, 1.0f);
  for (const Vec3f& place : places)
    for (const Vec3f& normal : normals) {
      double got = 0.0, mean = 0.0;
      for (int i = 0; i < 20000; ++i) {
        const Vec3f way = lamp.centre + share(random) * lamp.u + share(random) * lamp.v - place;
        const double square = glm::dot(way, way), given = way.y / (square * std::sqrt(square));
        got += given * std::max(glm::dot(way, normal) / std::sqrt(square), 0.0);
        mean += given / 4.0;
      }
      EXPECT_NEAR(stage.form(place, normal).x, got / mean, 0.06)
          << place.y << " " << normal.x << " " << normal.y;
    }
}

// Over a red floor that a lamp far above lights: what it sends up, by the directions in which it is met.
TEST(Relight, HasTheLightThatSurfacesScatter) {
  const Vec3f red(0.8f, 0.2f, 0.1f);
  const Stage stage(floor_scene(of_colour(red), point_lamp({0, 3000, 0}, Vec3f(9e6f))));
  std::mt19937 random(5);
  std::normal_distribution<float> any(0.0f, 1.0f);
  for (const Vec3f& place : places)
    for (const Vec3f& normal : normals) {
      double got = 0.0, mean = 0.0;  // of the floor's radiance, 1 over pi times its colour
      constexpr int rays = 4000;
      for (int i = 0; i < rays; ++i) {
        const Vec3f way = glm::normalize(Vec3f(any(random), any(random), any(random)));
        if (!stage.traced->caster().occluded({place, 0.0f, way})) continue;
        got += 4.0 * std::max(glm::dot(way, normal), 0.0f) / rays;
        mean += 1.0 / rays;
      }
      const Vec3f found = stage.form(place, normal);
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(found[c], (std::max(normal.y, 0.0f) + red[c] * got) / (0.25f + red[c] * mean),
                    0.17f)
            << place.y << " " << normal.x << " " << normal.y << " channel " << c;
    }
}

// Where the studio's white belongs: by Phi where the subject is, and with the light of the place drawn, by
// that at the stage's middle.
TEST(Relight, WhiteIsThatOfTheScene) {
  const Vec3f lamp(0.4f, 3.0f, 0.2f), power(3.0f, 2.0f, 1.0f), ambient(0.05f, 0.1f, 0.15f);
  const Mesh box = plain_box({0.7f, 0.2f, -0.3f}, {1.3f, 0.8f, 0.3f}, 0.5f);
  Shot shot(floor_scene(of_colour(Vec3f(0.0f)), point_lamp(lamp, power)), box,
            synthetic::look_at({0, 1, 6}, {0, 0.5, 0}, 320, 240, 60.0));
  shot.frame.ambient = ambient;
  shot.frame.exposure = 2.0f;
  ProcessorRenderer renderer;
  for (const SubjectLighting lighting :
       {SubjectLighting::off, SubjectLighting::shade, SubjectLighting::relit}) {
    shot.frame.subjects[0].lighting = lighting;
    const RenderPlan plan = renderer.plan(shot.frame, {});
    const auto white = renderer.white(shot.frame, plan.subjects.at(0));
    ASSERT_TRUE(white);
    float direct = 0.0f;  // per power
    for (const Vec3f& point : plan.subjects[0].points) {
      const Vec3f place = lighting == SubjectLighting::off ? point : Vec3f(0, 1, 0);
      direct += 0.25f / glm::dot(lamp - place, lamp - place) /
                static_cast<float>(plan.subjects[0].points.size());
    }
    for (int c = 0; c < 3; ++c) {
      const float phi = ambient[c] + power[c] * direct;
      EXPECT_NEAR((*white)[c], 2.0f * phi / 3.14159f, 0.003f) << c;
    }
  }
  shot.frame.lights[0].radiance = shot.frame.ambient = Vec3f(0.0f);
  const RenderPlan dark = renderer.plan(shot.frame, {});
  EXPECT_FALSE(renderer.white(shot.frame, dark.subjects.at(0)));
  shot.frame.scene = nullptr;
  shot.frame.lights.clear();
  const RenderPlan alone = renderer.plan(shot.frame, {});
  EXPECT_FALSE(renderer.white(shot.frame, alone.subjects.at(0)));
}

using RelightPictureTest = testing::BackendTest;

/// A ball of paint, photographed by \p cameras of a ring.
synthetic::Photographed ball(int cameras) {
  Hull hull;
  synthetic::add_ellipsoid(hull, {0, 1, 0}, Vec3f(0.4f), 40);
  const std::vector<Camera> ring = synthetic::ring(cameras, 2.5, 1.0, {0, 1, 0}, 128, 128, 30.0);
  synthetic::Photographed out = synthetic::photographed(hull, ring);
  out.mesh.texturing = texture_hull(hull, ring, {});
  return out;
}

// Of a ball each pixel is as many times brighter than with shade as its normal says, and half of that
// with half of it; with few cameras and with more than a vertex holds.
TEST_P(RelightPictureTest, IsShadeTimesTheForm) {
  const Vec3f lamp(1.2f, 2.4f, 1.5f), power(6.0f, 5.0f, 4.0f), ambient(0.3f, 0.2f, 0.1f);
  const struct {
    int cameras;
    float amount;
  } cases[] = {{3, 0.5f}, {9, 1.0f}};
  for (const auto& [cameras, amount] : cases) {
    const synthetic::Photographed subject = ball(cameras);
    Shot shot(floor_scene(of_colour(Vec3f(0.0f)), point_lamp(lamp, power)), subject.mesh,
              synthetic::look_at({0.2, 1.2, 2.4}, {0, 1, 0}, 160, 160, 30.0));
    shot.frame.ambient = ambient;
    shot.settings.shadow = ShadowQuality::off;
    shot.settings.mirror = MirrorMode::off;
    shot.frame.subjects[0].grade.slope = Vec3f(0.25f);  // nothing is clipped
    shot.frame.subjects[0].lighting = SubjectLighting::shade;
    shot.draw(0.2f);
    const Picture shade = shot.picture;
    shot.frame.subjects[0].lighting = SubjectLighting::relit;
    if (processor()) {
      shot.frame.subjects[0].relight = 0.0f;
      shot.draw(0.2f);
      EXPECT_EQ(shot.picture.pixels, shade.pixels);
    }
    shot.frame.subjects[0].relight = amount;
    shot.draw(0.2f);
    const Picture relit = shot.picture;
    for (const Vec3f& normal : {Vec3f(0, 0, 1), Vec3f(0.48f, 0.6f, 0.64f), Vec3f(0, -0.6f, 0.8f),
                                Vec3f(-0.6f, 0, 0.8f), Vec3f(0.6f, -0.48f, 0.64f)}) {
      const Vec3f place = Vec3f(0, 1, 0) + 0.4f * normal, way = lamp - place;
      shot.picture = shade;
      const Vec3f before = shot.at(place);
      shot.picture = relit;
      const Vec3f after = shot.at(place);
      const float square = glm::dot(way, way);
      const float cosine = std::max(glm::dot(way, normal) / std::sqrt(square), 0.0f);
      for (int c = 0; c < 3; ++c) {
        const float form =
            (ambient[c] + power[c] * cosine / square) / (ambient[c] + power[c] / (4.0f * square));
        EXPECT_NEAR(after[c], before[c] * (1.0f + amount * (form - 1.0f)),
                    0.003f + 0.04f * before[c])
            << cameras << " cameras, " << normal.x << " " << normal.y << " channel " << c;
      }
    }
  }
}

// A soft edge has the light of the body beside it: a ball of one colour shows no rim.
TEST_P(RelightPictureTest, SoftEdgesHaveTheBodysLight) {
  synthetic::Photographed subject = ball(3);
  for (Picture& picture : subject.pictures)
    for (std::size_t i = 0; i < picture.pixels.size(); ++i)
      if (i % 4 != 3) picture.pixels[i] = 200;
  // From below all that it sees is dark but for the light from all sides.
  Shot shot(floor_scene(of_colour(Vec3f(0.0f)), point_lamp({0, 3.5f, -1.0f}, Vec3f(12.0f))),
            subject.mesh, synthetic::look_at({0.0, 0.2, 2.4}, {0, 1, 0}, 160, 160, 30.0));
  shot.frame.ambient = Vec3f(0.1f);
  shot.settings.shadow = ShadowQuality::off;
  shot.settings.mirror = MirrorMode::off;
  shot.settings.soft_edges = true;
  shot.frame.subjects[0].lighting = SubjectLighting::relit;
  shot.draw(0.0f);
  float lowest = 0.0f, middle = 0.0f;  // of the picture's rows
  for (int x = 40; x < 120; ++x) {
    for (int y = 80; y < 160; ++y) {
      const float value = synthetic::to_linear(
          static_cast<float>(shot.picture.pixels[4 * static_cast<std::size_t>(y * 160 + x)]) /
          255.0f);
      (y < 100 ? middle : lowest) = std::max(y < 100 ? middle : lowest, value);
    }
  }
  EXPECT_GT(middle, 0.01f);
  EXPECT_LT(lowest, 1.3f * middle) << "a rim with the light of all sides is twice as bright";
}

INSTANTIATE_TEST_SUITE_P(Api, RelightPictureTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
