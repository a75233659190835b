// SPDX-License-Identifier: LGPL-2.1-or-later
// Calibration against synthetic truth: the board's corners seen with noise by cameras in a ring.
#include "studio/calibration/calibrate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "rig/floor.h"
#include "support/calibration_takes.h"

namespace polyhull::calibration {
namespace {

// The root mean square over the cameras, and the worst.
struct Summary {
  double centre = 0.0, rotation = 0.0, focal = 0.0;  // m, degrees, a part
  double worst_centre = 0.0, worst_rotation = 0.0;
};

Summary summary_of(const std::vector<CameraError>& errors, const std::vector<Camera>& truth) {
  Summary out;
  const double n = static_cast<double>(errors.size());
  for (std::size_t c = 0; c < errors.size(); ++c) {
    const double centre = glm::length(errors[c].centre);
    const double rotation = glm::degrees(glm::length(errors[c].rotation));
    const double focal = errors[c].lens[0] / truth[c].K[0][0];
    out.centre += centre * centre / n;
    out.rotation += rotation * rotation / n;
    out.focal += focal * focal / n;
    out.worst_centre = std::max(out.worst_centre, centre);
    out.worst_rotation = std::max(out.worst_rotation, rotation);
  }
  out.centre = std::sqrt(out.centre);
  out.rotation = std::sqrt(out.rotation);
  out.focal = std::sqrt(out.focal);
  return out;
}

// Few cameras and corners, for what does not depend on many.
RingSettings small_ring(unsigned seed) {
  RingSettings settings;
  settings.cameras = 4;
  settings.instants = 60;
  settings.near_views = 8;
  settings.board = {7, 6, 0.12};
  settings.seed = seed;
  return settings;
}

// What calibrate() says against the take.
std::string refusal(const Take& take) {
  try {
    calibrate(take, {});
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), Error::Kind::bad_input);
    return error.what();
  }
  ADD_FAILURE() << "was not refused";
  return "";
}

void expect_refused(const Take& take, const std::vector<std::string>& words) {
  const std::string text = refusal(take);
  for (const std::string& word : words)
    EXPECT_NE(text.find(word), std::string::npos) << word << " not in: " << text;
}

TEST(Calibrate, EightCamerasAtAQuarterPixel) {
  RingSettings settings;
  settings.board = {13, 8, 0.08};  // an A0 sheet
  settings.instants = 160;
  settings.near_views = 30;
  const TrueTake truth = make_ring(settings);
  const Calibration found = calibrate(truth.take, {});
  const Summary errors = summary_of(errors_of(found.rig.cameras, truth.cameras), truth.cameras);
  std::printf("centre %.3f mm (worst %.3f), rotation %.4f (worst %.4f), focal %.4f %%, rms %.4f\n",
              1e3 * errors.centre, 1e3 * errors.worst_centre, errors.rotation,
              errors.worst_rotation, 1e2 * errors.focal, found.adjusted.rms);
  EXPECT_LE(errors.worst_centre, 1e-3);
  EXPECT_LE(errors.worst_rotation, 0.02);
  EXPECT_LE(errors.focal, 5e-4);
  // Of both coordinates together.
  EXPECT_LE(found.adjusted.rms / std::sqrt(2.0), 1.05 * 0.25);
  EXPECT_NEAR(found.adjusted.noise, 0.25, 0.004);
  for (const ViewFit& fit : found.adjusted.views) EXPECT_TRUE(fit.used);
  EXPECT_EQ(found.faults({}), std::vector<std::string>{});
}

TEST(Calibrate, WithoutNoiseTheTruth) {
  RingSettings settings = small_ring(3);
  settings.noise = 0.0;
  const TrueTake truth = make_ring(settings);
  const Calibration found = calibrate(truth.take, {});
  for (const CameraError& error : errors_of(found.rig.cameras, truth.cameras)) {
    EXPECT_LT(glm::length(error.centre), 1e-6);
    EXPECT_LT(glm::length(error.rotation), 1e-6);
    EXPECT_LT(std::abs(error.lens[0]), 1e-3);
    EXPECT_LT(std::abs(error.lens[4]), 1e-6);
  }
}

TEST(Calibrate, CovariancesAreHonest) {
  int inside = 0, all = 0;
  double squares = 0.0;
  const auto count = [&](double error, double sigma) {
    inside += std::abs(error) <= 3.0 * sigma;
    squares += error * error / (sigma * sigma);
    ++all;
  };
  double centre = 0.0, rotation = 0.0;  // errors in units of their whole covariances, squared
  for (unsigned seed = 1; seed <= 5; ++seed) {
    RingSettings settings = small_ring(seed);
    settings.noise = 0.5;
    const TrueTake truth = make_ring(settings);
    const Calibration found = calibrate(truth.take, {});
    const std::vector<CameraError> errors = errors_of(found.rig.cameras, truth.cameras);
    for (std::size_t c = 0; c < errors.size(); ++c) {
      const Uncertainty& sure = found.adjusted.uncertainties[c];
      centre += glm::dot(errors[c].centre, glm::inverse(sure.centre) * errors[c].centre);
      rotation += glm::dot(errors[c].rotation, glm::inverse(sure.rotation) * errors[c].rotation);
      for (int i = 0; i < 3; ++i) {
        count(errors[c].centre[i], std::sqrt(sure.centre[i][i]));
        count(errors[c].rotation[i], std::sqrt(sure.rotation[i][i]));
      }
      for (int i = 0; i < 9; ++i) count(errors[c].lens[i], sure.lens[i]);
    }
  }
  const double numbers = 3.0 * 5.0 * 4.0;
  std::printf("%d of %d within 3 sigma, mean square %.3f; by covariances %.3f, %.3f\n", inside, all,
              squares / all, centre / numbers, rotation / numbers);
  EXPECT_GE(inside, 0.99 * all);
  // Neither boasting nor hiding, and about the right axes: around the optical axis a camera is ten times surer.
  EXPECT_NEAR(squares / all, 1.0, 0.2);
  EXPECT_NEAR(centre / numbers, 1.0, 0.4);
  EXPECT_NEAR(rotation / numbers, 1.0, 0.4);
}

TEST(Calibrate, TheFloorsViewMakesTheWorld) {
  TrueTake truth = make_ring(small_ring(5));
  add_floor_view(truth, 0.25, 9);
  Calibration found = calibrate(truth.take, {});
  Floor floor;
  floor.view = truth.take.instants.size() - 1;
  move_to_floor(found, floor);
  EXPECT_EQ(found.rig.up, Vec3(0.0, 1.0, 0.0));
  // The board of .7 m tells the directions of a stage of 4 m only so well.
  for (std::size_t c = 0; c < truth.cameras.size(); ++c) {
    const CameraError error = error_of(found.rig.cameras[c], truth.cameras[c]);
    EXPECT_LT(glm::length(error.centre), 6e-3);
    EXPECT_LT(glm::length(error.rotation), 3e-3);
  }
  floor.thickness = 0.01;
  const double before = found.rig.cameras[0].centre().y;
  move_to_floor(found, floor);
  EXPECT_NEAR(found.rig.cameras[0].centre().y, before + 0.01, 1e-9);
}

TEST(Calibrate, ThreePointsMakeTheWorld) {
  const TrueTake truth = make_ring(small_ring(5));
  Calibration found = calibrate(truth.take, {});
  Floor floor;
  for (const Vec3& point : {Vec3(0.0), Vec3(1.0, 0.0, 0.0), Vec3(0.0, 0.0, 1.0)}) {
    std::vector<std::pair<std::size_t, Vec2>> seen;
    for (std::size_t c = 0; c < truth.cameras.size(); ++c)
      seen.emplace_back(c, *truth.cameras[c].project(point));
    floor.points.push_back(triangulate(found.rig, seen));
  }
  move_to_floor(found, floor);
  for (std::size_t c = 0; c < truth.cameras.size(); ++c)
    EXPECT_LT(glm::length(error_of(found.rig.cameras[c], truth.cameras[c]).centre), 6e-3);
  floor.points[2] = 2.0 * floor.points[1] - floor.points[0];
  EXPECT_THROW(move_to_floor(found, floor), Error);
}

TEST(Calibrate, KnownLensesStay) {
  RingSettings settings = small_ring(6);
  settings.near_views = 0;
  settings.instants = 12;
  TrueTake truth = make_ring(settings);
  for (std::size_t c = 0; c < truth.cameras.size(); ++c)
    truth.take.cameras[c].known = truth.cameras[c];
  const Calibration found = calibrate(truth.take, {});
  for (std::size_t c = 0; c < truth.cameras.size(); ++c) {
    EXPECT_EQ(found.rig.cameras[c].K, truth.cameras[c].K);
    EXPECT_EQ(found.rig.cameras[c].distortion, truth.cameras[c].distortion);
  }
  for (const CameraError& error : errors_of(found.rig.cameras, truth.cameras))
    EXPECT_LT(glm::length(error.centre), 6e-3);
}

TEST(Calibrate, ViewsThatDoNotFitAreNamed) {
  RingSettings settings = small_ring(7);
  settings.cameras = 8;
  TrueTake truth = make_ring(settings);
  // Of instants that three cameras see, so that two can outvote one.
  std::vector<int> cameras(truth.take.instants.size(), 0);
  for (const View& view : truth.take.views) ++cameras[view.instant];
  std::vector<std::size_t> wrong;
  for (std::size_t v = 0; v < truth.take.views.size() && wrong.size() < 4; ++v) {
    int& seen = cameras[truth.take.views[v].instant];
    if (seen < 3) continue;
    wrong.push_back(v);
    seen = 0;
  }
  ASSERT_EQ(wrong.size(), 4u);
  // A board that moved between two cameras' pictures, far and little; one read the wrong way round.
  for (Vec2& corner : truth.take.views[wrong[0]].corners) corner += Vec2(25.0, -10.0);
  for (Vec2& corner : truth.take.views[wrong[1]].corners) corner.x += 6.0;
  std::vector<int>& ids = truth.take.views[wrong[2]].ids;
  for (int& id : ids) id = truth.take.board.count() - 1 - id;
  const std::size_t partly = wrong.back();
  wrong.pop_back();
  truth.take.views[partly].corners[4] += Vec2(9.0, 0.0);
  const Calibration found = calibrate(truth.take, {});
  for (std::size_t v = 0; v < truth.take.views.size(); ++v)
    EXPECT_EQ(found.adjusted.views[v].used, std::find(wrong.begin(), wrong.end(), v) == wrong.end())
        << v;
  EXPECT_FALSE(found.adjusted.views[partly].corner_used[4]);
  EXPECT_NEAR(found.adjusted.noise, 0.25, 0.01);
}

// 8x6 corners look the same turned: each camera counts from either end.
TEST(Calibrate, BoardsThatLookTheSameTurned) {
  RingSettings settings = small_ring(8);
  settings.board = {8, 6, 0.1};
  TrueTake truth = make_ring(settings);
  for (std::size_t v = 0; v < truth.take.views.size(); v += 3)
    for (int& id : truth.take.views[v].ids) id = settings.board.count() - 1 - id;
  const Calibration found = calibrate(truth.take, {});
  EXPECT_NEAR(found.adjusted.noise, 0.25, 0.01);
  for (const CameraError& error : errors_of(found.rig.cameras, truth.cameras))
    EXPECT_LT(glm::length(error.centre), 4e-3);

  // One view tells nothing about it.
  Take one = truth.take;
  std::erase_if(one.views, [](const View& view) { return view.instant >= 60; });
  for (std::size_t c = 0; c < truth.cameras.size(); ++c) one.cameras[c].known = truth.cameras[c];
  std::vector<int> seen(one.instants.size(), 0);
  for (const View& view : one.views) ++seen[view.instant];
  const std::size_t shared = std::ranges::find(seen, 2) - seen.begin();
  std::erase_if(one.views, [&](const View& view) { return view.instant != shared; });
  std::vector<TakeCamera> cameras;
  for (View& view : one.views) {
    cameras.push_back(one.cameras[view.camera]);
    view.camera = cameras.size() - 1;
  }
  one.cameras = cameras;
  expect_refused(one, {"looks the same after half a turn", cameras[0].name, cameras[1].name});
}

TEST(Calibrate, MirroredPicturesAreNamed) {
  TrueTake truth = make_ring(small_ring(9));
  for (View& view : truth.take.views) {
    if (view.camera != 2) continue;
    // As find() would number a reflected board: 6 rows, so by rows.
    for (Vec2& corner : view.corners) corner.x = 1919.0 - corner.x;
    for (int& id : view.ids) id = (5 - id / 7) * 7 + id % 7;
  }
  expect_refused(truth.take, {"'cam2'", "mirrored"});
}

TEST(Calibrate, ContradictionsAreNamed) {
  TrueTake truth = make_ring(small_ring(10));
  // The second camera's pictures are of other instants.
  std::vector<std::size_t> own;
  for (std::size_t v = 0; v < truth.take.views.size(); ++v)
    if (truth.take.views[v].camera == 1) own.push_back(v);
  for (std::size_t i = 0; i + 1 < own.size(); ++i) {
    std::swap(truth.take.views[own[i]].corners, truth.take.views[own[i + 1]].corners);
  }
  expect_refused(truth.take, {"'cam1'", "contradict"});
}

TEST(Calibrate, WhatCannotBeIsRefused) {
  RingSettings settings = small_ring(11);
  settings.cameras = 6;
  const TrueTake truth = make_ring(settings);
  Take take = truth.take;
  take.board.square = 0.0;
  expect_refused(take, {"squares have a side of 0 mm"});
  take = truth.take;
  take.board.columns = 2;
  expect_refused(take, {"2x6 inner corners"});
  take = truth.take;
  take.cameras.clear();
  take.views.clear();
  expect_refused(take, {"no camera"});

  take = truth.take;
  std::erase_if(take.views, [](const View& view) { return view.camera == 3; });
  expect_refused(take, {"'cam3'", "no picture"});

  take = truth.take;
  int left = 3;
  std::erase_if(take.views, [&](const View& view) { return view.camera == 3 && left-- <= 0; });
  expect_refused(take, {"'cam3'", "3 pictures"});

  // The fourth camera's views are its own.
  take = truth.take;
  const std::size_t instants = take.instants.size();
  for (std::size_t i = 0; i < instants; ++i) take.instants.push_back("b" + take.instants[i]);
  for (View& view : take.views)
    if (view.camera == 3) view.instant += instants;
  expect_refused(take, {"No view of the board connects 'cam3' with"});

  take = truth.take;
  take.views[5].corners[2].x = NAN;
  expect_refused(take, {"not finite", take.cameras[take.views[5].camera].name});
  take = truth.take;
  take.views[5].ids[2] = take.views[5].ids[3];
  expect_refused(take, {"twice"});
}

// All boards face the camera: focal length and distance cannot be told apart.
TEST(Calibrate, ParallelViewsAreRefused) {
  for (const double noise : {0.0, 0.25, 1.0}) {
    RingSettings settings = small_ring(12);
    settings.cameras = 1;
    settings.instants = 0;
    settings.near_views = 0;
    settings.noise = noise;
    TrueTake truth = make_ring(settings);
    for (int i = 0; i < 20; ++i) add_parallel_view(truth, i, noise);
    expect_refused(truth.take, {"'cam0'", "parallel"});
  }
}

}  // namespace
}  // namespace polyhull::calibration
