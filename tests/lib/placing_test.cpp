// SPDX-License-Identifier: LGPL-2.1-or-later
// Where cameras are put, and what is expected of them.
#include "studio/plan/placing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/thread_pool.h"
#include "builtin/default_rig.h"
#include "studio/plan/forecast.h"
#include "support/refusal.h"

namespace polyhull {
namespace {

/// 3 m from the axis, 1.4 m high, small pictures.
std::vector<Camera> cameras_at(const std::vector<double>& azimuths) {
  Camera like;
  like.width = 512;
  like.height = 384;
  like.K = from_rows({350.0, 0.0, 255.5, 0.0, 350.0, 191.5, 0.0, 0.0, 1.0});
  std::vector<Camera> cameras;
  for (const double azimuth : azimuths) {
    const double angle = glm::radians(azimuth);
    cameras.push_back(
        aimed(like, Vec3(3.0 * std::sin(angle), 1.4, 3.0 * std::cos(angle)), Vec3(0.0, 0.95, 0.0)));
    cameras.back().name = "cam" + std::to_string(cameras.size() - 1);
  }
  return cameras;
}

Sight seen_by(const std::vector<Camera>& cameras, const std::vector<StageBody>& bodies,
              const std::vector<SurfacePoint>& points) {
  Sight sum = no_sight(points.size());
  for (const Sight& sight : sights_of(cameras, bodies, points)) add(sight, sum);
  return sum;
}

PlanRequest small_request(int cameras) {
  PlanRequest request;
  request.cameras = cameras;
  request.width = 512;
  request.height = 384;
  request.fov = 72.36;
  request.distance = 3.0;
  request.heights = {1.4};
  return request;
}

/// How far the stage's corners reach from the picture's middle, 1 at its border.
double reach_of(const Camera& camera, const Stage& stage) {
  const Bounds box = stage.bounds();
  double most = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const auto pixel =
        camera.project({corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                        corner & 4 ? box.max.z : box.min.z});
    if (!pixel) return INFINITY;
    most = std::max({most, std::abs(pixel->x - camera.K[2][0]) / (0.5 * camera.width),
                     std::abs(pixel->y - camera.K[2][1]) / (0.5 * camera.height)});
  }
  return most;
}

std::string refusal(const PlanRequest& request) {
  return test::refusal_of([&] { candidates_of(request); });
}

bool mentions(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Sights, OneCameraSeesItsSide) {
  const std::vector<StageBody> bodies = stage_bodies(Stage(), 0.0);
  const std::vector<SurfacePoint> points = surface_points(bodies, 400);
  ASSERT_EQ(points.size(), 400 * bodies.size());
  const std::vector<Camera> cameras = cameras_at({0.0});
  const Sight sight = sights_of(cameras, bodies, points).front();
  std::size_t front = 0, seen = 0, empty_within = 0, in_front = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 to = glm::normalize(cameras[0].centre() - points[i].at);
    const double cosine = glm::dot(to, points[i].normal);
    if (cosine <= 0.0) {
      EXPECT_EQ(sight.facing[i], 0) << "the back is not seen";
    } else if (cosine > 0.3) {
      ++front;
      seen += sight.facing[i] > 0;
      if (sight.facing[i] > 0) {
        EXPECT_NEAR(sight.facing[i], 255.0 * cosine, 0.51);
      }
    }
    // Straight before what the camera looks at, nothing is seen to be empty.
    empty_within += cosine > 0.99 && sight.empty[i] != 0;
    in_front += cosine > 0.99;
  }
  EXPECT_GT(static_cast<double>(seen), 0.85 * static_cast<double>(front));  // arms hide some
  EXPECT_LT(seen, front);
  EXPECT_LE(20 * empty_within, in_front);  // but beside fingers
}

TEST(Sights, CostOfTwoIsThatOfTheirSum) {
  const std::vector<StageBody> bodies = stage_bodies(Stage(), 0.0);
  const std::vector<SurfacePoint> points = surface_points(bodies, 100);
  const std::vector<Sight> sights = sights_of(cameras_at({0.0, 100.0}), bodies, points);
  Sight sum = sights[0];
  add(sights[1], sum);
  EXPECT_NEAR(cost_of(sights[0], sights[1]), error_of(sum).cost(), 1e-3);
  EXPECT_LT(error_of(sum).cost(), error_of(sights[0]).cost());
}

TEST(Sights, FacingCamerasAddLittle) {
  const std::vector<StageBody> bodies = stage_bodies(Stage(), 0.0);
  const std::vector<SurfacePoint> points = surface_points(bodies, 400);
  const auto hull = [&](const std::vector<double>& azimuths) {
    return error_of(seen_by(cameras_at(azimuths), bodies, points)).hull;
  };
  const double two = hull({0.0, 90.0}), ring = hull({0.0, 90.0, 180.0, 270.0});
  const double far = hull({0.0, 90.0, 225.0, 315.0});
  EXPECT_GT(ring, 0.6 * two);
  EXPECT_LT(far, 0.6 * ring);
  // Half a circle has as many outlines, but nobody sees the other side's colours.
  const SightError half = error_of(seen_by(cameras_at({0.0, 45.0, 90.0, 135.0}), bodies, points));
  const SightError around =
      error_of(seen_by(cameras_at({0.0, 90.0, 225.0, 315.0}), bodies, points));
  EXPECT_GT(half.unseen, 2.0 * around.unseen);
}

TEST(Forecast, FourAtRightAnglesAndThePlannedOnes) {
  const Stage stage;
  const Forecast ring = forecast_of(cameras_at({0.0, 90.0, 180.0, 270.0}), stage);
  const std::vector<Camera> planned = plan_cameras(small_request(4));
  const Forecast plan = forecast_of(planned, stage);
  ASSERT_EQ(ring.places, 5);
  ASSERT_EQ(plan.places, 5);
  EXPECT_LT(plan.hull_mean, 0.75 * ring.hull_mean);
  EXPECT_LT(plan.refined_mean, 0.72 * ring.refined_mean);
  EXPECT_LT(plan.refined_mean, 4.0);  // mm
  EXPECT_GT(plan.overlap, ring.overlap + 0.03);
  EXPECT_LT(plan.seen_by[0], 0.12);
  EXPECT_NEAR(plan.seen_by[0] + plan.seen_by[1] + plan.seen_by[2], 1.0, 1e-9);

  ASSERT_EQ(planned.size(), 4u);
  for (std::size_t a = 0; a < 4; ++a) {
    EXPECT_EQ(planned[a].name, "cam" + std::to_string(a));
    EXPECT_NEAR(distance_of(planned[a]), 3.0, 1e-9);
    EXPECT_NEAR(planned[a].centre().y, 1.4, 1e-9);
    for (std::size_t b = 0; b < a; ++b) EXPECT_GE(off_facing(planned[a], planned[b]), 25.0);
  }
}

TEST(Plan, SameForAnyNumberOfThreads) {
  PlanRequest request = small_request(3);
  request.width = 128;
  request.height = 96;
  const std::vector<Camera> planned = plan_cameras(request);
  set_pool_threads(1);
  const std::vector<Camera> again = plan_cameras(request);
  set_pool_threads(0);
  EXPECT_EQ(again, planned);
}

TEST(Forecast, BuiltInRigStandsAsPlanned) {
  const StagedRig staged = staged_rig(default_rig());
  const Forecast forecast = forecast_of(staged.cameras, staged.stage);
  EXPECT_LT(forecast.refined_mean, 4.5);  // mm; 9.9 where two pairs face each other
  EXPECT_LT(forecast.unseen, 0.11);
  for (const Camera& a : staged.cameras) {
    for (const Camera& b : staged.cameras) EXPECT_GE(off_facing(a, b), 39.9);
  }
}

TEST(Forecast, CutBodiesAreToldAndLeftOut) {
  std::vector<Camera> cameras = cameras_at({0.0, 90.0, 225.0});
  cameras[1].K[0][0] = cameras[1].K[1][1] = 2000.0;  // a tele lens on the shirt
  const Forecast forecast = forecast_of(cameras, Stage());
  EXPECT_EQ(forecast.places, 0);
  EXPECT_EQ(forecast.cut, (std::vector<int>{0, 5, 0}));
  EXPECT_LT(forecast.stage_share, 0.1);
  EXPECT_TRUE(mentions(text_of(forecast, cameras), "cam1"));
}

TEST(OneMore, FillsTheGap) {
  // Three of four: the fourth does not face one of them.
  const std::vector<Camera> cameras = cameras_at({0.0, 90.0, 225.0});
  const std::optional<Camera> found = one_more(cameras, Stage());
  ASSERT_TRUE(found);
  const Camera& more = *found;
  for (const Camera& camera : cameras) {
    EXPECT_GE(off_facing(more, camera), 25.0);
    EXPECT_LE(off_facing(more, camera), 145.0) << "no neighbour either";
  }
  // Half way between the outlines that are there, on the one side or the other.
  EXPECT_NEAR(std::fmod(azimuth_of(more), 180.0), 135.0, 20.0);
  EXPECT_NEAR(distance_of(more), 3.0, 1e-9);
  EXPECT_NEAR(more.centre().y, 1.4, 1e-9);
}

TEST(StagedRig, OfAnyWorld) {
  // The built-in rig in millimetres, z up, elsewhere.
  const Rig metres = default_rig();
  const Mat3 turn = from_rows({0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0});  // y -> z
  const Vec3 move(4000.0, -700.0, 100.0);
  Rig other = metres;
  other.unit = "mm";
  other.up = turn * Vec3(0.0, 1.0, 0.0);
  for (Camera& camera : other.cameras) {
    camera.R = camera.R * glm::transpose(turn);
    camera.t = 1000.0 * camera.t - camera.R * move;
  }
  const Vec3 a = 1000.0 * (turn * metres.bounds->min) + move;
  const Vec3 b = 1000.0 * (turn * metres.bounds->max) + move;
  other.bounds = Bounds{glm::min(a, b), glm::max(a, b)};
  const StagedRig staged = staged_rig(other);
  EXPECT_NEAR(staged.stage.height, 2.3, 1e-9);
  EXPECT_NEAR(staged.stage.width, 2.4, 1e-9);
  const StagedRig straight = staged_rig(metres);
  for (std::size_t k = 0; k < metres.cameras.size(); ++k) {
    EXPECT_NEAR(distance_of(staged.cameras[k]), distance_of(straight.cameras[k]), 1e-9);
    EXPECT_NEAR(staged.cameras[k].centre().y, metres.cameras[k].centre().y, 1e-9);
    // The same picture of the same point.
    const Vec3 point(0.3, 1.0, -0.2);
    const Vec3 world = staged.linear * point + staged.origin;
    const Vec2 here = *staged.cameras[k].project(point), there = *other.cameras[k].project(world);
    EXPECT_NEAR(glm::length(here - there), 0.0, 1e-6);
  }
  Rig unbound = metres;
  unbound.bounds.reset();
  EXPECT_THROW(staged_rig(unbound), Error);
}

TEST(Candidates, HoldTheWholeStage) {
  PlanRequest request;
  request.fov = 50.0;
  for (const Camera& camera : candidates_of(request)) {
    const Bounds box = request.stage.bounds();
    for (int corner = 0; corner < 8; ++corner) {
      const auto pixel =
          camera.project({corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                          corner & 4 ? box.max.z : box.min.z});
      ASSERT_TRUE(pixel);
      EXPECT_TRUE(pixel->x > 0 && pixel->y > 0 && pixel->x < 1919 && pixel->y < 1079);
    }
    EXPECT_LT(distance_of(camera), 9.0);
  }
}

TEST(Candidates, StandWithinTheWalls) {
  PlanRequest request = small_request(4);
  request.stage = {2.0, 2.0, 2.2};
  request.room = Vec2(7.0, 4.4);
  std::size_t farther = 0;
  const std::vector<Camera> found = candidates_of(request);
  for (const Camera& camera : found) {
    const Vec3 centre = camera.centre();
    EXPECT_LE(std::abs(centre.x), 3.5 - 0.3 + 1e-9);
    EXPECT_LE(std::abs(centre.z), 2.2 - 0.3 + 1e-9);
    EXPECT_LE(distance_of(camera), 3.0 + 1e-9);
    farther += distance_of(camera) > 2.99;
  }
  // As far as was asked for where the walls allow it, nearer elsewhere.
  EXPECT_GT(farther, 10u);
  EXPECT_GT(found.size(), farther + 10);
  // Where the whole stage must be seen, from the ends of the room only.
  request.distance.reset();
  request.fov = 90.0;
  const std::vector<Camera> whole = candidates_of(request);
  EXPECT_GE(whole.size(), 4u);
  EXPECT_LT(whole.size(), 72u);
  for (const Camera& camera : whole) EXPECT_LT(reach_of(camera, request.stage), 1.0);
  request.fov = 60.0;
  EXPECT_TRUE(mentions(refusal(request), "--distance")) << refusal(request);
  request.room = Vec2(2.5, 8.0);
  EXPECT_TRUE(mentions(refusal(request), "more than 2.6 x 2.6 m")) << refusal(request);
}

// Where cameras stand and look.
TEST(TableOf, TellsPanAndTilt) {
  std::vector<Camera> cameras = cameras_at({30.0, 300.0, 180.0});
  const std::string text = table_of(cameras, Stage());
  // 1.4 m high, 3 m away, at what is .95 m high.
  EXPECT_TRUE(mentions(
      text, "cam0          30.0     3.00 m    1.50 m    2.60 m    1.40 m    210.0     -8.5"))
      << text;
  EXPECT_TRUE(mentions(
      text, "cam1         300.0     3.00 m   -2.60 m    1.50 m    1.40 m    120.0     -8.5"))
      << text;
  EXPECT_TRUE(mentions(text, "   1.40 m      0.0     -8.5")) << text;
}

TEST(Candidates, RefusalsSayWhatWouldDo) {
  PlanRequest request = small_request(4);
  request.fov = 20.0;
  EXPECT_TRUE(mentions(refusal(request), "a field of view of")) << refusal(request);
  request.distance = 1.0;
  EXPECT_TRUE(mentions(refusal(request), "1.70 m")) << refusal(request);
  // The distance that is said would do, does.
  request = small_request(4);
  request.distance = 1.75;
  const std::string text = refusal(request);
  EXPECT_FALSE(mentions(text, "cameras on their side")) << text;  // that is too little here
  const std::string before = "a distance of ";
  ASSERT_TRUE(mentions(text, before)) << text;
  const double enough = std::stod(text.substr(text.find(before) + before.size()));
  request.distance = enough;
  EXPECT_EQ(candidates_of(request).size(), 72u);
  request.distance = enough - 0.05;
  EXPECT_NE(refusal(request), "");
  // So do cameras on their side, where they are said to; behind walls no camera stands.
  request.distance = 2.0;
  EXPECT_TRUE(mentions(refusal(request), "cameras on their side (--picture 384x512 --fov 57.5)"))
      << refusal(request);
  request.distance = 1.75;
  request.room = Vec2(3.2, 3.2);
  EXPECT_TRUE(mentions(refusal(request), "degrees would do")) << refusal(request);
  request = small_request(1);
  EXPECT_TRUE(mentions(refusal(request), "2 to 64")) << refusal(request);
  request = small_request(4);
  request.fov = 170.0;
  EXPECT_TRUE(mentions(refusal(request), "10 to 150")) << refusal(request);
  request = small_request(4);
  request.heights = {-1.0};
  EXPECT_TRUE(mentions(refusal(request), "above the floor")) << refusal(request);
  request = small_request(4);
  request.distance.reset();
  request.fov = 10.0;
  request.stage = {12.0, 12.0, 4.0};
  EXPECT_TRUE(mentions(refusal(request), "30 m")) << refusal(request);
  EXPECT_THROW(stage_bodies({0.5, 0.5, 2.3}), Error);
  EXPECT_THROW(stage_bodies({2.0, 2.0, 1.5}), Error);
}

}  // namespace
}  // namespace polyhull
