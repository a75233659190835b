// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/calibration/outline_poses.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

#include "base/error.h"
#include "support/matte_damage.h"
#include "support/refusal.h"
#include "support/scenes.h"
#include "support/synthetic.h"

using namespace polyhull;
using namespace polyhull::calibration;
using namespace polyhull::test;

namespace {

constexpr int instants_seen = 40;

/// What \p camera sees of a ball, within \p noise px: the points in which lines of sight touch it.
void add_ball(Rings& rings, const Camera& camera, const Vec3& middle, double radius, double noise,
              Dice& dice) {
  const Vec3 back = camera.centre() - middle;
  const double distance = glm::length(back), sine = radius / distance;
  const Vec3 axis = back / distance, u = glm::normalize(glm::cross(axis, Vec3(0.3, 0.5, 0.8)));
  const Vec3 v = glm::cross(axis, u);
  constexpr int corners = 200;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / corners;
    const Vec3 around = std::cos(angle) * u + std::sin(angle) * v;
    const auto pixel =
        camera.project(middle + radius * (sine * axis + std::sqrt(1.0 - sine * sine) * around));
    rings.points.emplace_back(*pixel +
                              Vec2(dice.between(-noise, noise), dice.between(-noise, noise)));
  }
  rings.ends.push_back(static_cast<std::uint32_t>(rings.points.size()));
}

/// Three balls here and there before the cameras of \p rig.
std::vector<OutlineInstant> balls_before(const Rig& rig, double noise) {
  std::vector<OutlineInstant> instants;
  Dice dice(7);
  for (int i = 0; i < instants_seen; ++i) {
    std::vector<Vec3> middles;
    for (int ball = 0; ball < 3; ++ball)
      middles.push_back({dice.between(-0.6, 0.6), dice.between(0.2, 1.7), dice.between(-0.6, 0.6)});
    instants.emplace_back();
    for (const Camera& camera : rig.cameras) {
      instants.back().emplace_back();
      for (const Vec3& middle : middles)
        add_ball(instants.back().back(), camera, middle, 0.12, noise, dice);
    }
  }
  return instants;
}

void move(Camera& camera, const Vec3& axis, double degrees, const Vec3& by) {
  const Vec3 centre = camera.centre() + by;
  camera.R =
      Mat3(glm::rotate(glm::dmat4(1.0), glm::radians(degrees), glm::normalize(axis))) * camera.R;
  camera.t = -(camera.R * centre);
}

double degrees_between(const Mat3& a, const Mat3& b) {
  const Mat3 turn = a * glm::transpose(b);
  return glm::degrees(
      std::acos(std::clamp(0.5 * (turn[0][0] + turn[1][1] + turn[2][2] - 1.0), -1.0, 1.0)));
}

TEST(OutlinePoses, ABumpedCameraIsPutBack) {
  for (const int cameras : {4, 8}) {
    const Rig truth = ring_around_person(cameras, 3);
    const auto instants = balls_before(truth, 0.5);
    Rig bumped = truth;
    move(bumped.cameras[2], Vec3(1, 2, 1), 1.5, Vec3(0.03, -0.02, 0.01));
    const OutlinePoses found = poses_from_outlines(bumped, instants, {2});
    EXPECT_GT(found.camera_before[2], 5.0);
    EXPECT_LT(found.camera_after[2], 0.4);
    for (std::size_t i = 0; i < truth.cameras.size(); ++i) {
      if (i != 2) {
        EXPECT_EQ(found.rig.cameras[i], truth.cameras[i]);
      }
    }
    const Camera &is = found.rig.cameras[2], &should = truth.cameras[2];
    EXPECT_LT(glm::distance(is.centre(), should.centre()), cameras == 4 ? 0.006 : 0.003);
    EXPECT_LT(degrees_between(is.R, should.R), cameras == 4 ? 0.12 : 0.06);
    EXPECT_LT(found.error_after, 0.2);
  }
}

TEST(OutlinePoses, ARigThatIsALittleOffIsMended) {
  for (const int cameras : {4, 8}) {
    const Rig truth = ring_around_person(cameras, 3);
    const auto instants = balls_before(truth, 0.5);
    Rig off = truth;
    Dice dice(5);
    const auto any = [&](double size) {
      return Vec3(dice.between(-size, size), dice.between(-size, size), dice.between(-size, size));
    };
    std::vector<std::size_t> all;
    for (std::size_t i = 0; i < off.cameras.size(); ++i) {
      move(off.cameras[i], any(1.0), 0.3, any(0.01));
      all.push_back(i);
    }
    const OutlinePoses found = poses_from_outlines(off, instants, all);
    EXPECT_GT(found.error_before, 1.5);
    EXPECT_LT(found.error_after, 0.2);
    // How the cameras stand to each other, whichever way the whole has turned.
    double before = 0.0, after = 0.0;
    for (std::size_t i = 1; i < off.cameras.size(); ++i) {
      const auto between = [&](const Rig& rig) {
        return rig.cameras[i].R * glm::transpose(rig.cameras[0].R);
      };
      before += degrees_between(between(off), between(truth));
      after += degrees_between(between(found.rig), between(truth));
    }
    EXPECT_LT(after, 0.4 * before);
  }
}

TEST(OutlinePoses, TooFewPointsAreRefused) {
  const Rig rig = ring_around_person(4, 3);
  auto instants = balls_before(rig, 0.5);
  for (OutlineInstant& instant : instants) instant[1] = {};
  test::expect_refused([&] { poses_from_outlines(rig, instants, {1}); },
                       {"Camera 'cam1' shares 0 frontier points"});
}

}  // namespace
