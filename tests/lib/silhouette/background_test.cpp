// SPDX-License-Identifier: LGPL-2.1-or-later
#include "view/background.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "builtin/shapes.h"
#include "scene/viewport_control.h"
#include "support/picture_error.h"

namespace polyhull {
namespace {

using synthetic::rms;

Scene box_scene() {
  Scene scene;
  scene.materials.resize(2);
  scene.materials[0].base_colour = {0.7f, 0.4f, 0.2f};
  scene.materials[1].emission = Vec3f(6.0f);
  scene.meshes = {box("box", 0, {-0.3f, 0, -0.3f}, {0.3f, 0.6f, 0.3f}),
                  parallelogram("floor", 0, {-1, 0, 1}, {2, 0, 0}, {0, 0, -2}),
                  parallelogram("lamp", 1, {-0.5f, 2, -0.5f}, {1, 0, 0}, {0, 0, 1})};
  Light lamp;
  lamp.centre = {0, 2, 0};
  lamp.u = {0.5f, 0, 0};
  lamp.v = {0, 0, 0.5f};
  lamp.radiance = Vec3f(6.0f);
  lamp.mesh = 2;
  scene.lights = {lamp};
  return scene;
}

const Camera camera = look_at({1, 1.5, 2}, {0, 0.3, 0}, 45, 48, 32);

TEST(Background, WorksOnlyWhenSomethingChanged) {
  using Work = Background::Work;
  Background background(box_scene());
  const std::vector<Light> lights = background.scene().lights;
  EXPECT_EQ(background.update(camera, lights, 1.0f), Work::lit);
  EXPECT_EQ(background.update(camera, lights, 1.0f), Work::none);
  const std::vector<Vec3f> first = background.picture();
  EXPECT_EQ(background.update(camera, lights, 0.5f), Work::drawn);
  EXPECT_EQ(background.update(look_at({1, 1.6, 2}, {0, 0.3, 0}, 45, 48, 32), lights, 1.0f),
            Work::drawn);
  std::vector<Light> brighter = lights;
  brighter[0].radiance *= Vec3f(0.5f, 0.25f, 2.0f);
  EXPECT_EQ(background.update(camera, brighter, 1.0f), Work::drawn);
  EXPECT_EQ(background.announcement().lights, brighter);
  EXPECT_EQ(background.update(camera, lights, 1.0f), Work::drawn);
  EXPECT_LT(rms(background.picture(), first), 1e-6) << "brightness there and back";
  std::vector<Light> moved = lights;
  moved[0].centre.x += 0.4f;
  EXPECT_EQ(background.update(camera, moved, 1.0f), Work::lit);
  EXPECT_GT(rms(background.picture(), first), 1e-3);
  EXPECT_EQ(background.update(camera, lights, 1.0f), Work::lit);
  EXPECT_EQ(background.picture(), first);
  background.set_contrast(1.0f);
  EXPECT_EQ(background.update(camera, lights, 1.0f), Work::none) << "nothing for the rasteriser";
  background.set_method(ViewMethod::rays);
  EXPECT_EQ(background.update(camera, lights, 1.0f), Work::drawn);
  background.set_contrast(0.1f);
  EXPECT_EQ(background.update(camera, lights, 1.0f), Work::drawn);
  EXPECT_THROW(background.update(camera, {}, 1.0f), Error);
}

TEST(Background, RefinementGoesToTheTruthWithoutNoiseOnTheWay) {
  Background background(box_scene());
  const std::vector<Light> lights = background.scene().lights;
  background.update(camera, lights, 1.0f);
  EXPECT_FALSE(background.refine(20));
  EXPECT_EQ(background.samples(), 0u);
  EXPECT_TRUE(background.refine(20));
  EXPECT_EQ(background.samples(), 1u);
  const TracedScene traced(box_scene());
  std::vector<Vec3f> truth(48 * 32, Vec3f(0.0f));
  PathOptions paths;
  paths.light_samples = 4;
  trace_paths(traced, camera, 0, 512, paths, truth);
  for (Vec3f& value : truth) value /= 512.0f;
  const double before = rms(background.picture(), truth);
  for (int i = 0; i < 400; ++i) background.refine(32);
  EXPECT_EQ(background.samples(), 401u);
  EXPECT_LT(rms(background.picture(), truth), 0.6 * before + 1e-3);
  EXPECT_LT(rms(background.picture(), truth), 4e-3);
}

TEST(ViewportControl, TurnsMovesAndComesBack) {
  const ViewportPose pose{{1, 1.5, 2}, {0, 0.3, 0}};
  const double distance = glm::length(pose.eye - pose.target);
  ViewportControl control;
  EXPECT_FALSE(control.move(10, 10, 100)) << "no button";
  EXPECT_FALSE(control.key("Home")) << "nothing to take back";
  control.press(1, 10, 10);
  EXPECT_TRUE(control.move(60, 10, 100));
  ViewportPose now = control.apply(pose);
  EXPECT_NEAR(glm::length(now.eye - now.target), distance, 1e-12);
  EXPECT_NEAR(now.eye.y, pose.eye.y, 1e-12) << "half the height to the side: a quarter turn";
  EXPECT_NEAR(glm::dot(now.eye - now.target, pose.eye - pose.target),
              (pose.eye.y - 0.3) * (pose.eye.y - 0.3), 1e-9);
  control.move(60, -1e6, 100);
  now = control.apply(pose);
  EXPECT_LT(now.eye.y, now.target.y);
  EXPECT_GT(std::hypot(now.eye.x, now.eye.z), 1e-3) << "never at the pole";
  EXPECT_FALSE(control.move(std::nan(""), 0, 100));
  EXPECT_TRUE(std::isfinite(control.apply(pose).eye.x));
  control.release(1);
  EXPECT_TRUE(control.key("Home"));
  now = control.apply(pose);
  EXPECT_EQ(now.eye, pose.eye);
  EXPECT_TRUE(control.wheel(1.0));
  now = control.apply(pose);
  EXPECT_LT(glm::length(now.eye - now.target), distance);
  for (int i = 0; i < 1000; ++i) control.wheel(1.0);
  now = control.apply(pose);
  EXPECT_GT(glm::length(now.eye - now.target), 1e-3);
  control.key("Home");
  control.key("d");
  now = control.apply(pose);
  EXPECT_NEAR(glm::length((now.eye - now.target) - (pose.eye - pose.target)), 0.0, 1e-12);
  const Vec3 shift = now.target - pose.target;
  EXPECT_NEAR(glm::dot(shift, pose.eye - pose.target), 0.0, 1e-12);
  EXPECT_GT(glm::dot(shift, glm::cross(Vec3(0, 1, 0), pose.eye - pose.target)), 0.0)
      << "to the right";
  EXPECT_FALSE(control.key("F13"));
  EXPECT_EQ(control.take(pose).target, now.target) << "whoever keeps the pose";
  EXPECT_FALSE(control.changed());
  EXPECT_EQ(control.apply(pose).target, pose.target);
}

}  // namespace
}  // namespace polyhull
