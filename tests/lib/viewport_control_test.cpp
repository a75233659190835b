// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/viewport_control.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

namespace polyhull {
namespace {

const ViewportPose front{{0.0, 1.0, 3.0}, {0.0, 1.0, 0.0}};

ViewportPose after(const std::function<void(ViewportControl&)>& change,
                   const ViewportPose& pose = front) {
  ViewportControl control;
  change(control);
  return control.apply(pose);
}
void drag(ViewportControl& control, int button, double dx, double dy) {
  control.press(button, 50.0, 60.0);
  EXPECT_TRUE(control.move(50.0 + dx, 60.0 + dy, 360));
  control.release(button);
}
void expect_at(const Vec3& found, const Vec3& expected) {
  EXPECT_LT(glm::length(found - expected), 1e-9)
      << found.x << " " << found.y << " " << found.z << " instead of " << expected.x << " "
      << expected.y << " " << expected.z;
}

// The scene turns with the hand: half a turn over the picture's height.
TEST(ViewportControl, DraggingTurnsAroundTheTarget) {
  const ViewportPose right = after([](auto& c) { drag(c, 1, 60.0, 0.0); });  // 30 degrees
  expect_at(right.eye, {-1.5, 1.0, 3.0 * std::cos(std::numbers::pi / 6)});
  expect_at(right.target, front.target);
  const ViewportPose down = after([](auto& c) { drag(c, 1, 0.0, 60.0); });
  expect_at(down.eye, {0.0, 2.5, 3.0 * std::cos(std::numbers::pi / 6)});
  // Never over the pole.
  const ViewportPose far_down = after([](auto& c) { drag(c, 1, 0.0, 1000.0); });
  EXPECT_GT(far_down.eye.z, 0.01);
  EXPECT_GT(far_down.eye.y, 3.9);
}

// What is under the hand goes along.
TEST(ViewportControl, DraggingWithOtherButtonsMoves) {
  for (const int button : {2, 3}) {
    const ViewportPose pose = after([&](auto& c) { drag(c, button, 36.0, -72.0); });
    expect_at(pose.eye, front.eye + Vec3(-0.3, -0.6, 0.0));
    expect_at(pose.target, front.target + Vec3(-0.3, -0.6, 0.0));
  }
}

TEST(ViewportControl, KeysAndWheelGoWhereTheySay) {
  const double five = std::numbers::pi / 36.0;
  const auto key = [](const char* name) {
    return after([&](auto& c) { EXPECT_TRUE(c.key(name)) << name; });
  };
  expect_at(key("Left").eye, {-3.0 * std::sin(five), 1.0, 3.0 * std::cos(five)});
  expect_at(key("Right").eye, {3.0 * std::sin(five), 1.0, 3.0 * std::cos(five)});
  expect_at(key("Up").eye, {0.0, 1.0 + 3.0 * std::sin(five), 3.0 * std::cos(five)});
  expect_at(key("Down").eye, {0.0, 1.0 - 3.0 * std::sin(five), 3.0 * std::cos(five)});
  expect_at(key("d").target, front.target + Vec3(0.15, 0.0, 0.0));
  expect_at(key("a").target, front.target - Vec3(0.15, 0.0, 0.0));
  expect_at(key("e").eye, front.eye + Vec3(0.0, 0.15, 0.0));
  expect_at(key("q").eye, front.eye - Vec3(0.0, 0.15, 0.0));
  for (const char* nearer : {"w", "plus", "KP_Add"})
    expect_at(key(nearer).eye, {0.0, 1.0, 3.0 * std::exp(-0.1)});
  for (const char* away : {"s", "minus", "KP_Subtract"})
    expect_at(key(away).eye, {0.0, 1.0, 3.0 * std::exp(0.1)});
  expect_at(after([](auto& c) { c.wheel(2.0); }).eye, {0.0, 1.0, 3.0 * std::exp(-0.2)});
  ViewportControl control;
  EXPECT_FALSE(control.key("x"));
  EXPECT_FALSE(control.key("Home"));
  control.key("Left");
  EXPECT_TRUE(control.key("Home"));
  EXPECT_FALSE(control.changed());
}

TEST(ViewportControl, NothingMovesWithoutAButton) {
  ViewportControl control;
  EXPECT_FALSE(control.move(10.0, 10.0, 360));
  control.press(1, 0.0, 0.0);
  control.release(2);  // another one
  EXPECT_TRUE(control.move(10.0, 0.0, 360));
  control.release(1);
  EXPECT_FALSE(control.move(20.0, 0.0, 360));
  EXPECT_FALSE(control.wheel(0.0));
  EXPECT_FALSE(control.wheel(std::nan("")));
}

TEST(ViewportControl, TakenChangesAreForgotten) {
  ViewportControl control;
  control.key("Left");
  control.key("d");
  const ViewportPose pose = control.apply(front), taken = control.take(front);
  expect_at(taken.eye, pose.eye);
  EXPECT_FALSE(control.changed());
  expect_at(control.apply(taken).eye, pose.eye);
}

}  // namespace
}  // namespace polyhull
