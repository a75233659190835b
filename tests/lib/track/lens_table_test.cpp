// SPDX-License-Identifier: LGPL-2.1-or-later
// Lens files: exact at their rows, monotone between them, whatever program wrote them, and refused by
// line where they are wrong.
#include "track/lens/lens_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <random>

#include "base/error.h"
#include "support/folder.h"
#include "track/lens/monotone_cubic.h"
#include "track/tracked_pose.h"

namespace polyhull {
namespace {

LensTable table(const std::string& text) {
  return LensTable(text, "lens.txt");
}

double focal_length(const LensTable& lens, double zoom, std::optional<double> focus = {}) {
  return lens.at({zoom, focus}).focal_length_mm.value();
}

TEST(MonotoneCubic, IsTheLineThroughPointsOnALine) {
  for (double x = -1.0; x <= 7.0; x += 0.1)
    EXPECT_NEAR(monotone_cubic({0, 1, 3, 4, 6}, {2, 5, 11, 14, 20}, x),
                2.0 + 3.0 * std::clamp(x, 0.0, 6.0), 1e-12);
  EXPECT_EQ(monotone_cubic({5}, {7}, -3.0), 7.0);
  EXPECT_DOUBLE_EQ(monotone_cubic({0, 2}, {0, 1}, 0.5), 0.25);
}

TEST(MonotoneCubic, IsExactAtThePointsAndMonotoneBetween) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> step(0.01, 3.0);
  for (int sign : {1, -1})
    for (int run = 0; run < 50; ++run) {
      std::vector<double> xs{0.0}, ys{1.0};
      for (int i = 0; i < 7; ++i) {
        xs.push_back(xs.back() + step(random));
        ys.push_back(ys.back() + (i == 3 ? 0.0 : sign * std::pow(step(random), 4.0)));
      }
      double before = ys[0];
      for (std::size_t i = 0; i < xs.size(); ++i) EXPECT_EQ(monotone_cubic(xs, ys, xs[i]), ys[i]);
      for (double x = 0.0; x < xs.back(); x += 0.01) {
        const double y = monotone_cubic(xs, ys, x);
        EXPECT_GE(sign * (y - before), -1e-12);
        before = y;
      }
    }
}

TEST(MonotoneCubic, IsFlatWhereItTurns) {
  const auto at = [](double x) { return monotone_cubic({0, 1, 2, 4}, {0, 1, 0, 3}, x); };
  EXPECT_EQ(at(1.0), 1.0);
  for (const double x : {0.999, 1.001}) {
    EXPECT_LT(at(x), 1.0);
    EXPECT_GT(at(x), 1.0 - 1e-5);
  }
  for (double x = 0.0; x <= 4.0; x += 0.01) EXPECT_TRUE(at(x) >= 0.0 && at(x) <= 3.0) << x;
}

// A focal length that grows by 20, of nine rows: a sixth of what straight lines are off.
TEST(MonotoneCubic, FollowsAZoom) {
  std::vector<double> xs, ys;
  for (double x = 0.0; x <= 1.0; x += 0.125) xs.push_back(x), ys.push_back(4.3 * std::pow(20, x));
  double worst = 0.0, straight = 0.0;
  for (double x = 0.0; x <= 1.0; x += 0.001) {
    const double truth = 4.3 * std::pow(20.0, x);
    const auto i = std::min<std::size_t>(static_cast<std::size_t>(x * 8.0), 7);
    const double line = ys[i] + (x - xs[i]) * 8.0 * (ys[i + 1] - ys[i]);
    worst = std::max(worst, std::abs(monotone_cubic(xs, ys, x) / truth - 1.0));
    straight = std::max(straight, std::abs(line / truth - 1.0));
  }
  EXPECT_LT(worst, straight / 6.0);
  EXPECT_LT(worst, 0.003);
}

TEST(LensTable, IsExactAtItsRowsInAnyOrder) {
  const LensTable lens = table(
      "# a PTZ head\n"
      "zoom focal_length_mm k1 entrance_pupil_cm\n"
      "0x4000 100 0.02 -1.5   # the long end\n"
      "\n"
      "0 5 -0.2 6\n"
      "8192\t25\t-.05\t+3\n");
  EXPECT_FALSE(lens.is_normalised());
  EXPECT_EQ(focal_length(lens, 0), 5.0);
  EXPECT_EQ(focal_length(lens, 8192), 25.0);
  EXPECT_EQ(focal_length(lens, 16384), 100.0);
  const LensState state = lens.at({8192.0, {}});
  EXPECT_EQ(state.distortion, (std::vector<double>{-0.05, 0, 0, 0, 0}));
  EXPECT_DOUBLE_EQ(state.entrance_pupil_m.value(), 0.03);
  EXPECT_FALSE(state.focus_distance_m || state.projection_offset_mm || state.outside ||
               state.blind);
  double before = 5.0;
  for (double zoom = 0.0; zoom <= 16384.0; zoom += 64.0) {
    const double now = focal_length(lens, zoom);
    EXPECT_GE(now, before);
    before = now;
  }
}

TEST(LensTable, HoldsItsEndsAndSaysSo) {
  const LensTable lens = table("zoom,focal_length_mm\n100,5\n200,10\n");
  EXPECT_FALSE(lens.at({100.0, {}}).outside);
  EXPECT_FALSE(lens.at({200.0, {}}).outside);
  for (const double zoom : {99.0, 201.0, 1e12}) {
    EXPECT_TRUE(lens.at({zoom, {}}).outside);
    EXPECT_EQ(focal_length(lens, zoom), zoom < 100 ? 5.0 : 10.0);
  }
  const LensState blind = lens.at({{}, 150.0});
  EXPECT_TRUE(blind.blind);
  EXPECT_FALSE(blind.focal_length_mm);
}

// Of each zoom a curve over focus, measured at other places.
TEST(LensTable, GoesByZoomAndFocus) {
  const LensTable lens = table(
      "zoom;focus;focal_length_mm\n"
      "0;0;10\n0;50;11\n0;100;12\n"
      "10;20;30\n10;100;38\n"
      "20;5;50\n");
  EXPECT_EQ(focal_length(lens, 0, 50.0), 11.0);
  EXPECT_DOUBLE_EQ(focal_length(lens, 0, 75.0), 11.5);
  EXPECT_DOUBLE_EQ(focal_length(lens, 10, 60.0), 34.0);
  EXPECT_EQ(focal_length(lens, 20, 77.0), 50.0);
  EXPECT_DOUBLE_EQ(focal_length(lens, 10, 0.0), 30.0);
  // 10, 30, 50 at this focus: a line.
  EXPECT_DOUBLE_EQ(focal_length(lens, 5, 0.0), 20.0);
  EXPECT_FALSE(lens.at({5.0, 0.0}).outside);
  EXPECT_TRUE(lens.at({5.0, 101.0}).outside);
  EXPECT_TRUE(lens.at({21.0, 5.0}).outside);
  EXPECT_TRUE(lens.at({5.0, {}}).blind);
}

TEST(LensTable, TablesOfEachEncoder) {
  const LensTable lens = table(
      "zoom focal_length_mm\n0 10\n1 30\n"
      "focus focus_distance_m\n0 0.5\n0.5 1\n1 inf\n");
  EXPECT_TRUE(lens.is_normalised());
  const LensState state = lens.at({0.5, 0.5});
  EXPECT_DOUBLE_EQ(state.focal_length_mm.value(), 20.0);
  EXPECT_DOUBLE_EQ(state.focus_distance_m.value(), 1.0);
  // By the reciprocal, 2, 1, 0: a line.
  EXPECT_DOUBLE_EQ(lens.at({0.5, 0.75}).focus_distance_m.value(), 2.0);
  EXPECT_EQ(lens.at({0.5, 1.0}).focus_distance_m, LensTable::farthest_m);
  EXPECT_TRUE(lens.at({0.5, {}}).blind);
  EXPECT_TRUE(lens.at({0.5, {}}).focal_length_mm);
}

TEST(LensTable, TakesWhatSpreadsheetsWrite) {
  const LensTable lens = table(
      "\xEF\xBB\xBF\"Zoom\",\"Focal length (mm)\",\"K1\",K4,\"Projection offset x [mm]\",,\r\n"
      "\"0\",5,-0.1,0.01,0.25,,\r\n,,,,\r\n"
      "100,25,-0.2,0.02,0.5,,\r\n");
  const LensState state = lens.at({100.0, {}});
  EXPECT_EQ(state.focal_length_mm, 25.0);
  EXPECT_EQ(state.distortion, (std::vector<double>{-0.2, 0, 0, 0, 0, 0.02, 0, 0}));
  EXPECT_EQ(state.projection_offset_mm, Vec2(0.5, 0.0));
}

// As spreadsheets save "Unicode text", and as the old Macintosh ended lines.
TEST(LensTable, TextsOfOtherSystems) {
  std::string wide = "\xFF\xFE";
  for (const char c : std::string("Zoom\tFocal length (mm)\r\n0\t9,5\r\n100\t29,5\r\n"))
    wide += c, wide += '\0';
  EXPECT_EQ(focal_length(table(wide), 50), 19.5);
  EXPECT_EQ(focal_length(table("zoom,focal_length_mm\r0,9.5\r100,29.5\r"), 50), 19.5);
}

TEST(LensTable, DecimalCommasWhereNoCommaParts) {
  for (const char* text :
       {"zoom;focal_length_mm;k1\n0,5;25,25;-,5e-1\n", "zoom focal_length_mm k1\n0,5 25,25 -0,05\n",
        "sep=,\nzoom,focal_length_mm,k1\n\"0,5\",\"25,25\",\"-0,05\"\n",
        "\"zoom\"\t\"focal length, mm\"\tk1\n\"0,5\"\t\"25,25\"\t-0.05\n"}) {
    const LensState state = table(text).at({0.5, {}});
    EXPECT_EQ(state.focal_length_mm, 25.25);
    EXPECT_EQ(state.distortion.at(0), -0.05);
    EXPECT_FALSE(state.outside);
  }
}

TEST(LensTable, UnitsAreTheHeadings) {
  for (const auto& [unit, value] :
       {std::pair{"mm", 2540.0}, {"cm", 254.0}, {"m", 2.54}, {"in", 100.0}, {"ft", 100.0 / 12.0}}) {
    const LensTable lens = table(fmt::format("focus focus_distance_{}\n0 {}\n", unit, value));
    EXPECT_NEAR(lens.at({{}, 0.0}).focus_distance_m.value(), 2.54, 1e-12) << unit;
  }
}

TEST(LensTable, AFieldOfViewIsAFocalLengthBeforeTheSensor) {
  const LensTable lens = table("zoom hfov_deg\n0 90\n1 60\n");
  const auto seen = [&](std::optional<double> sensor, double zoom) {
    TrackedPose pose;
    pose.sensor_width_mm = sensor;
    add_lens(pose, lens.at({zoom, {}}), false);
    return 360.0 / std::numbers::pi *
           std::atan(0.5 * *pose.sensor_width_mm / *pose.focal_length_mm);
  };
  for (const std::optional<double> sensor : {std::optional<double>{}, {13.2}}) {
    EXPECT_NEAR(seen(sensor, 0.0), 90.0, 1e-9);
    EXPECT_NEAR(seen(sensor, 1.0), 60.0, 1e-9);
  }
}

TEST(LensTable, AddsWhatAPoseDoesNotTell) {
  const LensTable lens = table(
      "zoom focal_length_mm k1 focus_distance_m entrance_pupil_m projection_offset_y_mm\n"
      "0 5 -0.1 3 0.1 0.5\n");
  TrackedPose pose;
  pose.axes = axes_of_angles(90, 0, 0);  // along -x
  add_lens(pose, lens.at({0.0, {}}), false);
  EXPECT_EQ(pose.focal_length_mm, 5.0);
  EXPECT_EQ(pose.focus_distance_m, 3.0);
  EXPECT_EQ(pose.distortion.at(0), -0.1);
  EXPECT_EQ(pose.projection_offset_mm, Vec2(0.0, 0.5));
  EXPECT_LT(glm::length(pose.place - Vec3(-0.1, 0, 0)), 1e-12);
  TrackedPose told;
  told.focal_length_mm = 7.0;
  told.focus_distance_m = 2.0;
  told.distortion = {0, 0, 0, 0, 0};
  told.projection_offset_mm = {0.1, 0.0};
  const TrackedPose before = told;
  add_lens(told, lens.at({0.0, {}}), true);
  EXPECT_EQ(told.focal_length_mm, before.focal_length_mm);
  EXPECT_EQ(told.focus_distance_m, before.focus_distance_m);
  EXPECT_EQ(told.distortion, before.distortion);
  EXPECT_EQ(told.projection_offset_mm, before.projection_offset_mm);
  EXPECT_EQ(told.place, before.place);
}

TEST(LensTable, RefusesByLine) {
  const auto refuses = [](const std::string& text, std::initializer_list<const char*> parts) {
    try {
      table(text);
      ADD_FAILURE() << text << " was taken";
    } catch (const Error& error) {
      const std::string what = error.what();
      EXPECT_TRUE(what.starts_with("lens.txt")) << what;
      for (const char* part : parts) EXPECT_NE(what.find(part), std::string::npos) << what;
    }
  };
  refuses("", {"empty", "zoom focal_length_mm"});
  refuses("# nothing\n\n", {"empty"});
  refuses("0 5\n1 6\n", {"line 1", "heading", "'zoom'"});
  refuses("zoom focal_length\n0 5\n", {"line 1", "'focal_length'", "focal_length_UNIT"});
  refuses("zoom fov\n0 5\n", {"'fov'", "hfov_deg"});
  refuses("zoom zoom k1\n0 5 1\n", {"'zoom' is there twice"});
  refuses("zoom k1 k1\n0 5 1\n", {"k1", "earlier"});
  refuses("zoom focal_length_mm hfov_deg\n0 5 1\n", {"hfov_deg", "earlier"});
  refuses("zoom k1\n0 1\nfocus k1\n0 1\n", {"line 3", "k1", "earlier"});
  refuses("zoom focus\n0 5\n", {"encoders alone"});
  refuses("zoom k1\n", {"line 1", "no rows"});
  refuses("zoom k1\nfocus k2\n0 1\n", {"line 1", "no rows"});
  refuses("zoom k1\n0 1\n\n2\n", {"line 4", "1 values", "line 1 names 2"});
  refuses("zoom k1\n0 1 2\n", {"line 2", "3 values"});
  refuses("zoom;k1\n0;1.000,5\n", {"line 2", "'1.000,5'", "behind a point"});
  refuses("zoom;k1\n0;1,000,5\n", {"line 2", "'1,000,5'", "behind a point"});
  refuses("zoom;k1\n16,384;1\n", {"line 2", "'16,384'", "column zoom", "thousands"});
  refuses("zoom k1\n0 nan\n", {"line 2", "'nan'"});
  refuses("zoom k1\n0 inf\n", {"line 2", "out of range"});
  refuses("zoom k1\n0xZ 1\n", {"'0xZ'", "column zoom"});
  refuses("zoom k1\ninf 1\n", {"line 2", "1e9"});
  refuses("zoom focal_length_mm\n0 0\n", {"line 2", "0 is out of range", "focal_length_mm", "0.1"});
  refuses("zoom focal_length_mm\n0 -5\n", {"-5 is out of range"});
  refuses("zoom hfov_deg\n0 180\n", {"180 is out of range"});
  refuses("zoom k1\n0 1\n3 1\n0 2\n", {"line 4", "line 2 is of the same"});
  refuses("zoom k1\n0 1\n1e-9 1\n", {"line 3", "within 1e-06"});
  refuses("zoom focus k1\n0 0 1\n0 1e-9 1\n", {"line 3", "within 1e-06"});
  refuses(std::string("zoom focal_length_mm\n0 9\0\n", 26), {"line 2", "UTF-8"});
  refuses("\xFF\xFEz", {"UTF-16 and broken", "UTF-8"});
  refuses("zoom \xFF\xFE\n0 1\n", {"line 1"});
  refuses(std::string(LensTable::largest_file + 1, ' '), {"at most"});
  std::string many = "zoom k1\n";
  for (std::size_t i = 0; i <= LensTable::most_rows; ++i) many += std::to_string(i) + " 1\n";
  refuses(many, {"line 10002", "more than 10000 rows"});
}

TEST(LensTable, FilesThatCannotBeRead) {
  const test::Folder folder;
  const std::string path = folder.file("a.csv");
  EXPECT_THROW(load_lens_table(path), Error);
  EXPECT_THROW(load_lens_table(folder.path), Error);
  std::ofstream(path) << "zoom,focal_length_mm\n0,5\n";
  EXPECT_EQ(focal_length(load_lens_table(path), 0), 5.0);
}

// Whatever a file holds, it is refused or tells finite numbers.
TEST(LensTable, SurvivesMutations) {
  const std::string good =
      "zoom focus focal_length_mm k1 focus_distance_m entrance_pupil_m\n"
      "0 0 5 -0.1 0.5 0.1\n0 9 6 -0.1 inf 0.1\n100 0 50 0.1 0.5 -0.1\n";
  std::mt19937 random(2);
  int refused = 0;
  for (int i = 0; i < 5000; ++i) {
    std::string text = good;
    for (unsigned flips = 1 + random() % 3; flips > 0; --flips) {
      const char with[] = "0123456789.-e \n,;#";
      text[random() % text.size()] =
          random() % 4 ? with[random() % (sizeof with - 1)] : static_cast<char>(random());
    }
    try {
      const LensState state = table(text).at({50.0, 4.0});
      for (const auto& value :
           {state.focal_length_mm, state.focus_distance_m, state.entrance_pupil_m})
        EXPECT_TRUE(!value || std::isfinite(*value)) << text;
      for (const double k : state.distortion) EXPECT_TRUE(std::isfinite(k)) << text;
      EXPECT_TRUE(!state.focal_length_mm || *state.focal_length_mm > 0.0) << text;
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 500);
}

}  // namespace
}  // namespace polyhull
