// SPDX-License-Identifier: LGPL-2.1-or-later
// Timecodes in OpenTrackIO's samples and in poses' messages, and which times they are.
#include "track/timecode.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "packets.h"
#include "track/opentrackio_sample.h"
#include "track/pose_message.h"

namespace polyhull {
namespace {

using namespace track_examples;

constexpr std::int64_t second = 1'000'000'000;

Timecode code(int h, int m, int s, int f, int numerator, int denominator = 1) {
  Timecode t;
  t.hours = h, t.minutes = m, t.seconds = s, t.frames = f;
  t.numerator = numerator, t.denominator = denominator;
  return t;
}

TEST(Timecode, IsATime) {
  EXPECT_EQ(time_of(code(10, 0, 0, 1, 25), false), 36000 * second + second / 25);
  EXPECT_EQ(time_of(code(0, 0, 0, 119, 120), false), 119 * second / 120);
  // 30 numbers a second for 30000/1001 frames: an hour lasts 3603.6 s, or leaves out 108.
  EXPECT_EQ(time_of(code(1, 0, 0, 0, 30000, 1001), false), 3603'600'000'000);
  EXPECT_EQ(time_of(code(1, 0, 0, 0, 30000, 1001), true), 107892LL * 1001 * second / 30000);
  EXPECT_EQ(time_of(code(1, 0, 0, 0, 60000, 1001), true), 107892LL * 1001 * second / 30000);
  EXPECT_EQ(time_of(code(1, 0, 0, 0, 30, 1), true), 3600 * second);  // nothing to leave out
  Timecode told = code(1, 0, 0, 0, 30000, 1001);
  told.drops = false;
  EXPECT_EQ(time_of(told, true), 3603'600'000'000);
  Timecode third = code(0, 0, 0, 2, 25);
  third.part = 3, third.parts = 4;
  EXPECT_EQ(time_of(third, false), 110'000'000);
  EXPECT_EQ(length_of(third), 10'000'000);
}

TEST(Timecode, RefusesWhatIsNone) {
  for (const Timecode& t :
       {code(24, 0, 0, 0, 25), code(0, 60, 0, 0, 25), code(0, 0, 60, 0, 25), code(0, 0, 0, 25, 25),
        code(0, 0, 0, -1, 25), code(0, 0, 0, 0, 0), code(0, 0, 0, 0, 25, 0),
        code(0, 0, 0, 0, 2'000'000), code(23, 59, 59, 0, 1, 1'000'000), code(0, 0, 0, 0, 1, 2)})
    EXPECT_FALSE(time_of(t, false));
  EXPECT_TRUE(time_of(code(0, 1, 0, 0, 30000, 1001), false));
  EXPECT_FALSE(time_of(code(0, 1, 0, 0, 30000, 1001), true));
  EXPECT_FALSE(time_of(code(0, 1, 0, 3, 60000, 1001), true));
  EXPECT_TRUE(time_of(code(0, 1, 0, 4, 60000, 1001), true));
  EXPECT_TRUE(time_of(code(0, 10, 0, 0, 30000, 1001), true));
}

nlohmann::json with_timecode() {
  nlohmann::json value = sample({0, 0, 0}, {1, 2, 3});
  value["timing"]["timecode"] = {{"hours", 1},
                                 {"minutes", 2},
                                 {"seconds", 3},
                                 {"frames", 4},
                                 {"frameRate", {{"num", 24000}, {"denom", 1001}}}};
  return value;
}

TrackedPose read(const nlohmann::json& value) {
  return pose_in({OpenTrackIOEncoding::json, {}, json_bytes(value)});
}

TEST(Timecode, OfOpenTrackIO) {
  nlohmann::json value = with_timecode();
  const auto timecode = read(value).timecode;
  ASSERT_TRUE(timecode);
  EXPECT_EQ(time_of(*timecode, false), time_of(code(1, 2, 3, 4, 24000, 1001), false));
  EXPECT_FALSE(timecode->drops);
  value["timing"]["timecode"]["dropFrame"] = false;
  value["timing"]["timecode"]["subFrame"] = 0;
  EXPECT_EQ(read(value).timecode->drops, false);
  EXPECT_EQ(read(value).timecode->parts, 1);
  // Fields, and as many parts as the sender has samples.
  value["timing"]["timecode"]["subFrame"] = 1;
  EXPECT_EQ(read(value).timecode->part, 1);
  EXPECT_EQ(read(value).timecode->parts, 2);
  value["timing"]["sampleRate"] = {{"num", 96000}, {"denom", 1001}};
  EXPECT_EQ(read(value).timecode->parts, 4);
  value["timing"]["timecode"]["subFrame"] = 7;
  EXPECT_EQ(read(value).timecode->parts, 8);
  EXPECT_FALSE(read(sample({0, 0, 0}, {1, 2, 3})).timecode);
  // A tracker that sees no video may send whatever it likes: the pose is good.
  for (const char* member : {"hours", "minutes", "seconds", "frames", "frameRate"}) {
    for (const nlohmann::json& spoilt :
         {nlohmann::json("1"), nlohmann::json(-1), nlohmann::json(1e30), nlohmann::json(99),
          nlohmann::json()}) {
      value = with_timecode();
      value["timing"]["timecode"][member] = spoilt;
      EXPECT_FALSE(read(value).timecode) << value.dump();
    }
  }
  value["timing"]["timecode"] = with_timecode()["timing"]["timecode"];
  value["timing"]["timecode"]["frameRate"]["denom"] = 0;
  EXPECT_FALSE(read(value).timecode);
}

TEST(Timecode, GoesThroughAMessage) {
  PoseMessage message;
  message.timecode_lag_ns = 20'000'000;
  for (const auto drops : {std::optional<bool>(), std::optional(true), std::optional(false)}) {
    Timecode t = code(1, 2, 3, 4, 60000, 1001);
    t.drops = drops;
    t.part = 1, t.parts = 3;
    message.pose.timecode = t;
    const PoseMessage again = parse_pose_message(pose_message_to_json(message));
    ASSERT_TRUE(again.pose.timecode);
    EXPECT_EQ(again.pose.timecode->drops, drops);
    EXPECT_EQ(time_of(*again.pose.timecode, false), time_of(t, false));
    EXPECT_EQ(length_of(*again.pose.timecode), length_of(t));
    EXPECT_EQ(again.timecode_lag_ns, 20'000'000);
  }
  const auto good = nlohmann::json::parse(pose_message_to_json(message));
  const auto refuses = [&](const char* name, const nlohmann::json& value) {
    nlohmann::json spoilt = good;
    spoilt[name] = value;
    EXPECT_THROW(parse_pose_message(spoilt.dump()), Error) << spoilt.dump();
  };
  for (const char* text : {"", "01:02:03", "01:02:03:99", "-1:02:03:04", "01:02:03:04x"})
    refuses("timecode", text);
  refuses("timecode", 7);
  refuses("timecode_rate", {25});
  refuses("timecode_rate", {25, 0});
  refuses("timecode_rate", {25, -1});
  refuses("timecode_rate", nlohmann::json());
  refuses("timecode_part", {3, 3});
  refuses("timecode_lag_ns", -1);
}

TEST(Timecode, SpreadsWhatSharesOne) {
  TimecodeSpread spread;
  EXPECT_EQ(spread.place(100, 40, 7000), 100);
  EXPECT_EQ(spread.place(100, 40, 7010), 110);
  EXPECT_EQ(spread.place(100, 40, 7010), 111);
  EXPECT_EQ(spread.place(100, 40, 6000), 112);
  EXPECT_EQ(spread.place(100, 40, 7100), 139);
  EXPECT_EQ(spread.place(140, 40, 7100), 140);
}

}  // namespace
}  // namespace polyhull
