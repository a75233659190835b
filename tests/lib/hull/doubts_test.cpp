// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/repair/doubts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <utility>

#include "support/figure.h"
#include "support/matte_damage.h"
#include "support/scenes.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

constexpr int points = 40;  // of all outlines, in a set

/// A walking person before a ring of cameras, contours within a pixel of the truth.
struct Stage {
  Rig rig;
  std::vector<Rings> rings;
  int off;  // the camera to be moved

  /// \p share: of the pictures' sides.
  Stage(int cameras, int seed, double share = 1.0)
      : rig(ring_around_person(cameras, seed)), off(seed % cameras) {
    Dice dice(seed);
    for (Camera& camera : rig.cameras) {
      camera.width = static_cast<int>(share * camera.width);
      camera.height = static_cast<int>(share * camera.height);
      for (int i = 0; i < 2; ++i) camera.K[i][i] *= share, camera.K[2][i] *= share;
      rings.push_back(standing_silhouette(camera, 0.9 * seed));
      for (Vec2f& p : rings.back().points) p += Vec2f(dice.between(-1, 1), dice.between(-1, 1));
    }
  }

  Camera& moved() { return rig.cameras[off]; }
  void turn(const Vec3& axis) {
    const Mat3 degree(glm::rotate(glm::dmat4(1.0), glm::radians(1.0), axis));
    moved().R = degree * moved().R, moved().t = degree * moved().t;
  }

  /// What a second's sets say.
  CameraDoubts doubts(Unseen unseen = Unseen::carve) const {
    std::vector<Silhouette> views;
    for (std::size_t i = 0; i < rings.size(); ++i) views.push_back({&rig.cameras[i], &rings[i]});
    const int each = std::max<int>(3, points / static_cast<int>(views.size()));
    CameraDoubts sum = find_doubts(views, unseen, each, 0);
    for (std::uint32_t round = 1; round < 25; ++round)
      sum += find_doubts(views, unseen, each, round);
    return sum;
  }
};

constexpr int stages = 5;

/// One of a few stages with \p cameras; photographing takes longer than asking.
const Stage& stage_of(int cameras, int seed) {
  static std::map<std::pair<int, int>, Stage> made;
  return made.try_emplace({cameras, seed}, cameras, seed).first->second;
}

TEST(Doubts, SoundSilhouettesAreNotDoubted) {
  for (const int cameras : {4, 5, 8})
    for (int seed = 1; seed <= stages; ++seed)
      for (const Unseen unseen : {Unseen::carve, Unseen::keep}) {
        const CameraDoubts doubts = stage_of(cameras, seed).doubts(unseen);
        EXPECT_EQ(doubtful_camera(doubts), -1) << cameras << " cameras, " << seed;
        EXPECT_LT(doubts.share_unexplained(), 0.02) << cameras << " cameras, " << seed;
        EXPECT_GT(doubts.asked[0], 25u);
      }
}

TEST(Doubts, LimbsOfAFewPixelsAreNotDoubted) {
  for (int seed = 1; seed <= stages; ++seed) {
    const CameraDoubts doubts = Stage(5, seed, 0.125).doubts();  // arms of 2 to 4 px
    EXPECT_EQ(doubtful_camera(doubts), -1) << seed;
    EXPECT_LT(doubts.share_unexplained(), 0.03) << seed;
  }
}

TEST(Doubts, ACameraThatIsOffIsNamed) {
  const auto expect_named = [](const char* how, int cameras, int at_least, auto move) {
    int named = 0;
    for (int seed = 1; seed <= stages; ++seed) {
      Stage stage = stage_of(cameras, seed);
      move(stage);
      const CameraDoubts doubts = stage.doubts();
      const int found = doubtful_camera(doubts);
      EXPECT_TRUE(found == stage.off || found == -1) << how << " " << cameras << " " << seed;
      EXPECT_GT(doubts.share_unexplained(), 0.04) << how << " " << cameras << " " << seed;
      EXPECT_TRUE(views_with_background(doubts).empty()) << how << " " << cameras << " " << seed;
      named += found == stage.off;
    }
    EXPECT_GE(named, at_least) << how << " " << cameras;
  };
  const auto turn = [](Stage& s) { s.turn({0, 1, 0}); };
  const auto tilt = [](Stage& s) { s.turn({1, 0, 0}); };
  expect_named("turned", 8, stages, turn);
  expect_named("tilted", 8, stages, tilt);
  expect_named("10 px beside", 8, stages, [](Stage& s) { s.moved().K[2][0] += 10.0; });
  expect_named("turned", 5, stages - 1, turn);
  expect_named("tilted", 5, stages, tilt);
  // Of four it is noticed, and mostly known, who it is.
  expect_named("turned", 4, stages - 2, turn);
  expect_named("tilted", 4, stages - 2, tilt);
}

TEST(Doubts, ATornMatteIsNamed) {
  for (int seed = 1; seed <= stages; ++seed) {
    Stage stage = stage_of(8, seed);
    // The matte ends above the legs.
    float top = 1e9f, bottom = 0.0f;
    Rings& rings = stage.rings[stage.off];
    for (const Vec2f& p : rings.points) top = std::min(top, p.y), bottom = std::max(bottom, p.y);
    for (Vec2f& p : rings.points) p.y = std::min(p.y, 0.4f * top + 0.6f * bottom);
    EXPECT_EQ(doubtful_camera(stage.doubts()), stage.off) << seed;
  }
}

TEST(Doubts, BackgroundInOneViewIsNoCameraThatIsOff) {
  for (const int cameras : {4, 5, 8})
    for (int seed = 1; seed <= stages; ++seed) {
      Stage stage = stage_of(cameras, seed);
      EXPECT_TRUE(views_with_background(stage.doubts()).empty()) << cameras << " " << seed;
      // A strip along the picture's left side.
      Rings& rings = stage.rings[stage.off];
      for (const Vec2f& p : {Vec2f(5, 5), Vec2f(5, 300), Vec2f(25, 300), Vec2f(25, 5)})
        rings.points.push_back(p);
      rings.ends.push_back(static_cast<std::uint32_t>(rings.points.size()));
      const CameraDoubts doubts = stage.doubts();
      EXPECT_EQ(doubtful_camera(doubts), -1) << cameras << " " << seed;
      ASSERT_EQ(views_with_background(doubts), std::vector<std::size_t>(1, stage.off))
          << cameras << " " << seed;
      EXPECT_LT(doubts.where[stage.off].x, 25.0);
    }
}

TEST(Doubts, ThreeCamerasCannotTell) {
  Stage stage(3, 1);
  stage.turn({1, 0, 0});
  const CameraDoubts doubts = stage.doubts();
  EXPECT_EQ(doubts.asked, std::vector<std::uint32_t>(3));
  EXPECT_EQ(doubtful_camera(doubts), -1);
}

TEST(Doubts, SumsGoBack) {
  Stage stage = stage_of(5, 2);
  stage.turn({1, 0, 0});
  CameraDoubts sum = stage.doubts();
  const CameraDoubts one = sum;
  sum += one;
  EXPECT_EQ(sum.asked[1], 2 * one.asked[1]);
  EXPECT_NEAR(sum.share_unexplained(), one.share_unexplained(), 1e-12);
  EXPECT_NEAR(sum.share_against(stage.off), one.share_against(stage.off), 1e-12);
  sum -= one;
  EXPECT_EQ(sum.against, one.against);
  EXPECT_EQ(sum.unexplained, one.unexplained);
}

}  // namespace
