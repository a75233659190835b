// SPDX-License-Identifier: LGPL-2.1-or-later
// polyhull-rig check on numbers alone: sizes and places that no stage has are noted, with the
// likeliest cause; those of good rigs are not.
#include "rig/check.h"

#include <gtest/gtest.h>

#include <functional>

#include "builtin/default_rig.h"
#include "rig/floor.h"
#include "rig/plausible.h"

namespace polyhull {
namespace {

std::string noted(const std::function<void(Rig&)>& change) {
  Rig rig = default_rig();
  change(rig);
  std::string all;
  for (const std::string& note : implausible_sizes(rig)) all += note + "\n";
  return all;
}

void expect_noted(const std::function<void(Rig&)>& change, const std::vector<std::string>& parts) {
  const std::string text = noted(change);
  for (const std::string& part : parts)
    EXPECT_NE(text.find(part), std::string::npos) << part << " not in: " << text;
}

// Another unit for the same numbers, or other numbers.
void scale(Rig& rig, double factor) {
  for (Camera& camera : rig.cameras) camera.t *= factor;
  if (!rig.bounds) return;
  rig.bounds->min *= factor;
  rig.bounds->max *= factor;
}

TEST(RigCheck, GoodSizesAreNotNoted) {
  EXPECT_EQ(noted([](Rig&) {}), "");
  EXPECT_EQ(noted([](Rig& r) { r.bounds.reset(); }), "");
  for (const char* unit : {"mm", "cm", "in", "ft", "0.37"})
    EXPECT_EQ(noted([&](Rig& r) {
                r.unit = unit;
                scale(r, 1.0 / r.metres_per_unit());
              }),
              "")
        << unit;
  // A table-top and a football ground.
  EXPECT_EQ(noted([](Rig& r) { scale(r, 0.1); }), "");
  EXPECT_EQ(noted([](Rig& r) { scale(r, 20.0); }), "");
}

// As of a calibration that saw no floor.
TEST(RigCheck, TheWorldOfOneCameraKnowsNoUp) {
  const auto notes = [](const Rig& rig) {
    std::string all;
    for (const std::string& note : examine_rig(rig).warnings) all += note + "\n";
    return all;
  };
  const Camera first = default_rig().cameras[0];
  Rig rig = moved_rig(default_rig(), {first.R, first.t});
  rig.cameras[0].R = Mat3(1.0);
  rig.cameras[0].t = Vec3(0.0);
  rig.up = Vec3(0, -1, 0);
  EXPECT_NE(notes(rig).find("the world is that of cam0"), std::string::npos) << notes(rig);
  EXPECT_NE(notes(rig).find("`polyhull-rig level`"), std::string::npos);
  EXPECT_EQ(notes(default_rig()), "");
}

TEST(RigCheck, AForgottenUnitIsNoted) {
  for (const bool bounds : {true, false}) {
    const auto in_unit = [&](double factor) {
      return [=](Rig& r) {
        if (!bounds) r.bounds.reset();
        scale(r, factor);
      };
    };
    expect_noted(in_unit(1000.0), {"too far", "30", "m from the middle", "--unit mm"});
    expect_noted(in_unit(100.0), {"too far", "--unit cm", "3."});
    expect_noted(
        [&](Rig& r) {
          in_unit(1.0)(r);
          r.unit = "mm";
        },
        {"too near", "0.003", "--unit m,"});
  }
}

TEST(RigCheck, ParallelCamerasAreJudgedByTheirSpacing) {
  const auto pair = [](double apart) {
    return [=](Rig& r) {
      r.bounds.reset();
      r.cameras.resize(2);
      r.cameras[1].R = r.cameras[0].R;
      r.cameras[1].t = r.cameras[0].t + Vec3(apart, 0, 0);
    };
  };
  EXPECT_EQ(noted(pair(0.09)), "");
  expect_noted(pair(900.0), {"900 m apart", "--unit mm"});
}

TEST(RigCheck, OneCameraInAnotherUnitIsNoted) {
  for (const double factor : {1000.0, 39.37})
    expect_noted([&](Rig& r) { r.cameras[2].t *= factor; },
                 {"cam2 stands", "times as far as the others", "another unit"});
}

TEST(RigCheck, BoundsThatDoNotFitAreNoted) {
  expect_noted(
      [](Rig& r) {
        r.bounds->min *= 1000.0;
        r.bounds->max *= 1000.0;
      },
      {"2400 x 2300 x 2400 m", "too large", "another unit"});
  expect_noted(
      [](Rig& r) {
        r.bounds->min *= 0.001;
        r.bounds->max *= 0.001;
      },
      {"0.0024 x 0.0023 x 0.0024 m", "too small", "another unit"});
  for (const double factor : {10.0, 39.37, 100.0, 0.01})
    expect_noted(
        [&](Rig& r) {
          r.bounds->min *= factor;
          r.bounds->max *= factor;
        },
        {factor > 1.0 ? "too large" : "too small"});
  expect_noted(
      [](Rig& r) {
        r.bounds->min.x += 9.0;
        r.bounds->max.x += 9.0;
      },
      {"from the point at which the cameras look", "unit or axes"});
}

TEST(RigCheck, UpAndHeightsAreNoted) {
  expect_noted([](Rig& r) { r.up = Vec3(0, 0, -1); }, {"upright along (", "up is probably 0 1 0"});
  expect_noted([](Rig& r) { r.up = Vec3(0, -1, 0); }, {"up is probably 0 1 0"});
  expect_noted(
      [](Rig& r) {
        r.bounds->min.y += 3.0;
        r.bounds->max.y += 3.0;
      },
      {"below the floor of the bounds", "cam0", "cam3"});
  // A camera on its side and one that looks down do not agree on another up.
  EXPECT_EQ(noted([](Rig& r) {
              const Mat3 turn = from_rows({0, -1, 0, 1, 0, 0, 0, 0, 1});
              r.cameras[1].R = turn * r.cameras[1].R;
              r.cameras[1].t = turn * r.cameras[1].t;
            }),
            "");
}

TEST(RigCheck, NotesReachTheReport) {
  Rig rig = default_rig();
  scale(rig, 1000.0);
  const RigReport report = examine_rig(rig);
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_NE(report.warnings[0].find("--unit mm"), std::string::npos) << report.warnings[0];
}

TEST(RigCheck, AnOpenFloorIsNoted) {
  Rig rig = default_rig();
  EXPECT_TRUE(examine_rig(rig).warnings.empty());
  rig.bounds.reset();
  ASSERT_EQ(examine_rig(rig).warnings.size(), 1u);
  EXPECT_NE(examine_rig(rig).warnings[0].find("polyhull-rig level"), std::string::npos);
  // One camera that looks ahead is enough to see where the feet are.
  Camera& camera = rig.cameras[3];
  const Vec3 centre(0.0, 0.5, 3.0);
  camera.R = Mat3(1, 0, 0, 0, -1, 0, 0, 0, -1);
  camera.t = -(camera.R * centre);
  EXPECT_TRUE(examine_rig(rig).warnings.empty());
}

TEST(RigCheck, OneCameraHasNoMiddleOfTheStage) {
  Rig rig = default_rig();
  rig.bounds.reset();
  rig.cameras.resize(1);
  EXPECT_EQ(examine_rig(rig).table.find("nan"), std::string::npos) << examine_rig(rig).table;
}

TEST(RigCheck, APersonsHeightInPixelsIsTold) {
  Rig rig = default_rig();
  EXPECT_NE(examine_rig(rig).table.find("a person of 1.75 m there is 40"), std::string::npos)
      << examine_rig(rig).table;
  rig.unit = "10";
  EXPECT_NE(examine_rig(rig).table.find("is 41 to 41 px high"), std::string::npos);
}

}  // namespace
}  // namespace polyhull
