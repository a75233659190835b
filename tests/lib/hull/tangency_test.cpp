// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/repair/tangency.h"

#include <gtest/gtest.h>

#include <fmt/format.h>
#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>

#include "support/figure.h"
#include "support/matte_damage.h"
#include "support/scenes.h"
#include "support/synthetic.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

std::vector<Silhouette> views_of(const Rig& rig, const std::vector<Rings>& rings) {
  std::vector<Silhouette> views;
  for (std::size_t i = 0; i < rings.size(); ++i) views.push_back({&rig.cameras[i], &rings[i]});
  return views;
}

/// A walking person in \p count instants before a ring of cameras, contours within \p noise px.
struct Walk {
  Rig rig;
  std::vector<std::vector<Rings>> instants;

  Walk(int cameras, int seed, int count, double noise) : rig(ring_around_person(cameras, seed)) {
    Dice dice(seed);
    for (int i = 0; i < count; ++i) {
      instants.emplace_back();
      for (const Camera& camera : rig.cameras) {
        instants.back().push_back(standing_silhouette(camera, 0.9 * seed + 0.04 * i));
        for (Vec2f& p : instants.back().back().points)
          p += Vec2f(dice.between(-noise, noise), dice.between(-noise, noise));
      }
    }
  }
  std::vector<PairTangency> pairs() const {
    std::vector<Tangency> all;
    for (const std::vector<Rings>& rings : instants) {
      const auto more = find_tangencies(views_of(rig, rings));
      all.insert(all.end(), more.begin(), more.end());
    }
    return median_by_pair(all);
  }
  int off() const { return camera_off(pairs(), rig.cameras.size()); }
};

void turn(Camera& camera, const Vec3& axis, double degrees) {
  const Mat3 turned(glm::rotate(glm::dmat4(1.0), glm::radians(degrees), axis));
  camera.R = turned * camera.R, camera.t = turned * camera.t;
}

TEST(Tangency, ExactOutlinesAgree) {
  Walk walk(6, 1, 1, 0.0);
  const auto found = find_tangencies(views_of(walk.rig, walk.instants[0]));
  ASSERT_GT(found.size(), 15u);
  for (const Tangency& tangency : found) EXPECT_LT(std::abs(tangency.error), 1.0);
}

TEST(Tangency, ErrorIsThePixelsThatOneOutlineIsBeside) {
  // Two cameras one above the other look ahead, a cube's silhouettes: the planes touch it at its sides.
  Rig rig;
  for (int i = 0; i < 2; ++i) {
    Camera camera;
    camera.name = fmt::format("cam{}", i), camera.width = 1000, camera.height = 1000;
    camera.K = Mat3(1000, 0, 0, 0, 1000, 0, 500, 500, 1);
    camera.t = Vec3(0, 0.3 * i, 0);
    rig.cameras.push_back(camera);
  }
  const auto square = [&](const Camera& camera, double aside) {
    Rings rings;
    for (const Vec2 corner : {Vec2(-.5, -.5), Vec2(-.5, .5), Vec2(.5, .5), Vec2(.5, -.5)})
      rings.points.emplace_back(*camera.project_ideal(Vec3(corner, 4.0)) + Vec2(aside, 0));
    rings.ends = {4};
    return rings;
  };
  for (const double aside : {0.0, 1.0, -7.0}) {
    const std::vector<Rings> rings{square(rig.cameras[0], 0.0), square(rig.cameras[1], aside)};
    const auto found = find_tangencies(views_of(rig, rings));
    ASSERT_EQ(found.size(), 2u);
    for (const Tangency& tangency : found)
      EXPECT_NEAR(std::abs(tangency.error), std::abs(aside), 0.02);
  }
}

TEST(Tangency, ACameraThatIsOffIsNamedAndNoOther) {
  int named = 0, tried = 0;
  for (const int cameras : {3, 4, 5, 8})
    for (int seed = 3; seed <= 4; ++seed) {
      Walk walk(cameras, seed, 3, 1.0);
      EXPECT_EQ(walk.off(), -1) << cameras << " cameras, " << seed;
      const int which = seed % cameras;
      const Camera sound = walk.rig.cameras[which];
      for (const Vec3 axis : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)}) {
        Camera& camera = walk.rig.cameras[which];
        camera = sound;
        turn(camera, axis, 1.0);
        const int found = walk.off();
        EXPECT_TRUE(found == which || found == -1) << cameras << " cameras, " << seed;
        named += found == which, ++tried;
        camera = sound;
        camera.t += 0.02 * axis;
        const int moved = walk.off();
        EXPECT_TRUE(moved == which || moved == -1) << cameras << " cameras, " << seed;
        named += moved == which, ++tried;
      }
    }
  // Three cameras, and a degree around the line of sight, are not always enough.
  EXPECT_GE(named, tried - 3);
}

TEST(Tangency, OutlinesThatLeaveThePictureSayNothing) {
  Walk walk(4, 2, 1, 0.0);
  for (std::size_t i = 0; i < 4; ++i)
    for (Vec2f& p : walk.instants[0][i].points)
      p.y = std::max(p.y, -0.5f), p.y = std::min(p.y, 767.5f);
  Camera& camera = walk.rig.cameras[0];
  camera.height = 100;
  for (Vec2f& p : walk.instants[0][0].points) p.y = std::min(p.y, 99.5f);
  for (const Tangency& tangency : find_tangencies(views_of(walk.rig, walk.instants[0])))
    EXPECT_LT(std::abs(tangency.error), 1.0);
}

TEST(Tangency, CamerasAtOnePlaceOrWithoutForegroundSayNothing) {
  Walk walk(3, 1, 1, 0.0);
  Rig& rig = walk.rig;
  rig.cameras[1].R = rig.cameras[0].R, rig.cameras[1].t = rig.cameras[0].t;
  walk.instants[0][2] = {};
  EXPECT_TRUE(find_tangencies(views_of(rig, walk.instants[0])).empty());
}

TEST(Tangency, RoundsAskAllPairs) {
  Walk walk(6, 1, 1, 0.0);
  const auto views = views_of(walk.rig, walk.instants[0]);
  std::vector<Tangency> sum;
  for (std::uint32_t round = 0; round < 5; ++round) {
    const auto some = find_tangencies(views, 3, round);
    EXPECT_LE(some.size(), 6u);
    sum.insert(sum.end(), some.begin(), some.end());
  }
  EXPECT_EQ(sum.size(), find_tangencies(views).size());
}

// Two miss each other by most; the one that the others agree with less is named, whatever its
// number.
TEST(Tangency, TheWorstCameraIsNamed) {
  for (const std::size_t worst : {0, 5}) {
    std::vector<PairTangency> pairs;
    for (std::size_t a = 0; a < 6; ++a)
      for (std::size_t b = a + 1; b < 6; ++b) {
        const bool of_both = a == 0 && b == 5, of_either = a == 0 || b == 5;
        const bool of_worst = a == worst || b == worst;
        pairs.push_back({a, b, of_both ? 20.0 : of_worst ? 2.0 : of_either ? 0.5 : 0.2});
      }
    EXPECT_EQ(camera_off(pairs, 6), static_cast<int>(worst));
  }
}

// Cameras agree as long as none of them misses another by 3 px.
TEST(Tangency, AgreeingViewsAreCounted) {
  const auto agreeing = [](std::size_t views, std::size_t off) {
    std::vector<PairTangency> pairs;
    for (std::size_t a = 0; a < views; ++a)
      for (std::size_t b = a + 1; b < views; ++b) pairs.push_back({a, b, a < off ? 3.5 : 2.5});
    return agreeing_views(pairs, views);
  };
  EXPECT_EQ(agreeing(5, 0), 5u);
  EXPECT_EQ(agreeing(5, 1), 4u);
  EXPECT_EQ(agreeing(5, 2), 3u);
  EXPECT_EQ(agreeing(5, 5), 1u);
  EXPECT_EQ(agreeing_views({}, 3), 3u);  // nothing is known against them
}

}  // namespace
