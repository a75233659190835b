// SPDX-License-Identifier: LGPL-2.1-or-later
// Key frames of a viewport: exact at their times, smooth where they say so, never past a key frame,
// and refused by name where the file is wrong.
#include "scene/key_frames.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "base/error.h"
#include "support/folder.h"
#include "support/refusal.h"

namespace polyhull {
namespace {

KeyFrame key(double time, double x, Easing easing = Easing::smooth, bool cut = false) {
  return {time, {{x, 1.0, 3.0}, {0.0, 1.0, -x}}, 50.0 + x, easing, cut};
}

double x_at(const KeyFrames& keys, double seconds) {
  return keys.at(seconds).pose.eye.x;
}

/// Of the eye, m/s, from both sides.
std::pair<double, double> speeds_at(const KeyFrames& keys, double seconds) {
  constexpr double step = 1e-6;
  const double x = x_at(keys, seconds);
  return {(x - x_at(keys, seconds - step)) / step, (x_at(keys, seconds + step) - x) / step};
}

TEST(KeyFrames, AreExactAtTheirTimesAndStandBeforeAndBehind) {
  const KeyFrames keys({key(1, 0), key(2, 4), key(4, 1)});
  for (const auto& [seconds, x] : {std::pair{0.0, 0.0}, {1, 0}, {2, 4}, {4, 1}, {100, 1}}) {
    const KeyFrames::View view = keys.at(seconds);
    EXPECT_EQ(view.pose.eye, Vec3(x, 1, 3));
    EXPECT_EQ(view.pose.target, Vec3(0, 1, -x));
    EXPECT_EQ(view.field_of_view, 50 + x);
    EXPECT_EQ(view.shot, 0u);
  }
  EXPECT_EQ(x_at(KeyFrames({key(3, 2)}), 1.0), 2.0);
}

TEST(KeyFrames, ASmoothMoveHasNoJerksAndRestsAtItsEnds) {
  const KeyFrames keys({key(0, 0), key(1, 1), key(3, 2), key(4, 4)});
  for (const double seconds : {1.0, 3.0}) {
    const auto [before, after] = speeds_at(keys, seconds);
    EXPECT_NEAR(before, after, 1e-4);
    EXPECT_GT(before, 0.4);
  }
  // Catmull-Rom's central difference of speeds 1 over 1 s and .5 over 2 s.
  EXPECT_NEAR(speeds_at(keys, 1.0).first, (1.0 * 2 + 0.5 * 1) / 3, 1e-4);
  EXPECT_NEAR(speeds_at(keys, 0.0).second, 0.0, 1e-4);
  EXPECT_NEAR(speeds_at(keys, 4.0).first, 0.0, 1e-4);
  EXPECT_NEAR(x_at(KeyFrames({key(0, 0), key(2, 8)}), 0.5), 8 * (3.0 / 16 - 2.0 / 64), 1e-12);
}

TEST(KeyFrames, NothingSwingsPastAKeyFrame) {
  // A stop between two moves stands still, and a turn does not go on.
  const KeyFrames keys({key(0, 0), key(0.1, 3), key(5, 3), key(5.2, 3.1), key(9, -2)});
  double last = 0.0;
  for (double t = 0.0; t <= 10.0; t += 0.01) {
    const double x = x_at(keys, t);
    if (t > 0.1 && t < 5.0) {
      EXPECT_DOUBLE_EQ(x, 3.0) << t;
    }
    EXPECT_LE(x, 3.1);
    EXPECT_GE(x, -2.0);
    if (t < 5.2) {
      EXPECT_GE(x, last) << t;
    }
    last = x;
  }
}

TEST(KeyFrames, EasingsSayHowAMoveBeginsAndEnds) {
  const struct {
    Easing easing;
    double begin, end, middle;
  } cases[] = {{Easing::linear, 1, 1, 0.5},
               {Easing::ease_in, 0, 1.5, 0.3125},
               {Easing::ease_out, 1.5, 0, 0.6875},
               {Easing::ease_in_out, 0, 0, 0.5}};
  for (const auto& c : cases) {
    const KeyFrames keys({key(0, 0), key(2, 4, c.easing)});
    EXPECT_NEAR(speeds_at(keys, 0.0).second, 2 * c.begin, 1e-4);
    EXPECT_NEAR(speeds_at(keys, 2.0).first, 2 * c.end, 1e-4);
    EXPECT_NEAR(x_at(keys, 1.0), 4 * c.middle, 1e-12);
  }
  // A smooth move takes up the speed of its neighbour.
  const KeyFrames taken({key(0, 0), key(2, 4, Easing::linear), key(4, 6)});
  EXPECT_NEAR(speeds_at(taken, 2.0).second, 2.0, 1e-4);
}

TEST(KeyFrames, ACutEndsAMoveAndBeginsAShot) {
  const KeyFrames keys(
      {key(0, 0), key(2, 4), key(2, -3, Easing::smooth, true), key(3, -2), key(5, 9, {}, true)});
  EXPECT_NEAR(x_at(keys, 1.999), 4.0, 1e-4);
  EXPECT_NEAR(speeds_at(keys, 1.9999).first, 0.0, 1e-2);
  EXPECT_EQ(x_at(keys, 2.0), -3.0);
  EXPECT_EQ(keys.at(1.999).shot, 0u);
  EXPECT_EQ(keys.at(2.0).shot, 1u);
  EXPECT_EQ(x_at(keys, 4.999), -2.0);  // nothing moves to the next cut
  EXPECT_EQ(x_at(keys, 5.0), 9.0);
  EXPECT_EQ(keys.at(7.0).shot, 2u);
}

// ---- files

std::string file(const std::string& keys) {
  return R"({"format": "polyhull-key-frames", "version": 1, "keys": [)" + keys + "]}";
}

constexpr char first[] =
    R"({"time": 0, "eye": [0, 1, 3], "target": [0, 1, 0], "field-of-view": 40})";

std::string refusal(const std::string& text) {
  return test::refusal_of([&] { parse_key_frames(text, "move.json"); });
}

TEST(KeyFrameFiles, WhatIsLeftOutIsAsBefore) {
  const KeyFrames keys = parse_key_frames(
      file(std::string(first) + R"(, {"time": 2.5, "eye": [2, 1, 3], "easing": "linear"},
           {"time": 2.5, "cut": true, "field-of-view": 20}, {"time": 4, "target": [0, 2, 0]})"),
      "move.json");
  ASSERT_EQ(keys.size(), 4u);
  EXPECT_NEAR(glm::length(keys.at(1.25).pose.eye - Vec3(1, 1, 3)), 0.0, 1e-12);
  EXPECT_EQ(keys.at(1.25).field_of_view, 40.0);
  EXPECT_EQ(keys.at(2.5).field_of_view, 20.0);
  EXPECT_EQ(keys.at(2.5).pose.eye, Vec3(2, 1, 3));
  EXPECT_EQ(keys.at(4).pose.target, Vec3(0, 2, 0));
  EXPECT_EQ(keys.at(4).field_of_view, 20.0);
}

TEST(KeyFrameFiles, AreRefusedByTheirMember) {
  const std::string one = std::string(first) + ", ";
  const std::pair<std::string, const char*> cases[] = {
      {"{\n  \"format\": ]", "move.json: not JSON at line 2"},
      {R"({"format": "polyhull-rig", "version": 1})", "\"format\": \"polyhull-key-frames\""},
      {R"({"format": "polyhull-key-frames", "version": 2, "keys": []})", "version 2"},
      {file(""), "keys: expected a list of 1 to"},
      {file("[0]"), "keys[0]: is [0]; expected an object"},
      {file(R"({"time": 0, "eye": [0, 1, 3], "target": [0, 1, 0]})"),
       "keys[0]: 'field-of-view' is missing; the first key frame must have it"},
      {file(one + R"({"eye": [1, 1, 3]})"), "keys[1]: 'time' is missing"},
      {file(one + R"({"time": 1, "fov": 40})"), "keys[1]: \"fov\" is unknown; there are \"time\""},
      {file(one + R"({"time": "1"})"), "keys[1].time: is \"1\"; expected seconds from 0 to"},
      {file(one + R"({"time": 0})"),
       "keys[1].time: is 0, that of the key frame before 0; times must"},
      {file(one + R"({"time": -1})"), "keys[1].time: is -1; expected seconds"},
      {file(one + R"({"time": 1, "eye": [1, 2]})"),
       "keys[1].eye: is [1,2]; expected three numbers"},
      {file(one + R"({"time": 1, "eye": [1, 2, 1e9]})"), "keys[1].eye: is 1000000000.0; expected"},
      {file(one + R"({"time": 1, "eye": [0, 1, 0]})"), "keys[1]: eye and target are at one place"},
      {file(one + R"({"time": 1, "field-of-view": 171})"), "expected degrees from 1 to 170"},
      {file(one + R"({"time": 1, "easing": "ease"})"), "expected one of \"smooth\", \"linear\""},
      {file(one + R"({"time": 1, "cut": 1})"), "keys[1].cut: is 1; expected true or false"},
      {file(one + R"({"time": 1, "cut": true, "easing": "linear"})"),
       "both \"cut\" and \"easing\""}};
  for (const auto& [text, words] : cases)
    EXPECT_NE(refusal(text).find(words), std::string::npos) << text << "\n" << refusal(text);
  EXPECT_THROW(load_key_frames("/nowhere/move.json"), Error);
}

TEST(KeyFrameFiles, SavedByAnySystem) {
  const test::Folder folder;
  const std::string path = folder.file("move.json");
  std::ofstream(path, std::ios::binary) << "\xEF\xBB\xBF" + file(first) + "\r\n";
  EXPECT_EQ(load_key_frames(path).size(), 1u);
}

}  // namespace
}  // namespace polyhull
