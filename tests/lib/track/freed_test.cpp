// SPDX-License-Identifier: LGPL-2.1-or-later
// FreeD: values decoded, dialects of senders, several packets in a datagram, broken packets refused.
#include "track/freed.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>

#include "base/error.h"
#include "packets.h"
#include "track/packet_error.h"
#include "track/pose_reader.h"

namespace polyhull {
namespace {

using namespace track_examples;

void expect_near(const Vec3& a, const Vec3& b, double tolerance) {
  EXPECT_LE(glm::length(a - b), tolerance);
}

TEST(FreeD, DecodesTheBytesOfTheTable) {
  // Pan 90° = 0x2D0000, tilt -45° = 0xE98000, roll 1/32768°; x 1 m = 64000 = 0x00FA00, y -1 m, height
  // 1/64 mm. The sum of the first 28 bytes is 0x53D.
  const Packet bytes{0xD1, 0x05, 0x2D, 0x00, 0x00, 0xE9, 0x80, 0x00, 0x00, 0x00,
                     0x01, 0x00, 0xFA, 0x00, 0xFF, 0x06, 0x00, 0x00, 0x00, 0x01,
                     0x00, 0x09, 0xC4, 0x01, 0x00, 0x02, 0x00, 0x00, 0x03};
  const FreeDPacket packet = parse_freed(bytes);
  EXPECT_EQ(packet.camera, 5);
  EXPECT_EQ(packet.degrees, (std::array<double, 3>{90.0, -45.0, 1.0 / 32768.0}));
  EXPECT_EQ(packet.metres, (std::array<double, 3>{1.0, -1.0, 1.0 / 64000.0}));
  EXPECT_EQ(packet.zoom, 2500u);
  EXPECT_EQ(packet.focus, 0x010002u);
}

TEST(FreeD, TurnsAsTheProtocolSays) {
  // To the right by 90°: along +x. Upwards by 45°.
  TrackedPose pose = pose_of(parse_freed(freed(1, {90, 0, 0}, {0, 0, 0}, 0, 0)), {});
  expect_near(pose.axes[1], {1, 0, 0}, 1e-12);
  expect_near(pose.axes[0], {0, -1, 0}, 1e-12);
  pose = pose_of(parse_freed(freed(1, {0, 45, 0}, {0, 0, 0}, 0, 0)), {});
  expect_near(pose.axes[1], {0, std::sqrt(0.5), std::sqrt(0.5)}, 1e-12);
  // Clockwise: the right side goes down.
  pose = pose_of(parse_freed(freed(1, {0, 0, 90}, {0, 0, 0}, 0, 0)), {});
  expect_near(pose.axes[0], {0, 0, -1}, 1e-12);
}

TEST(FreeD, SettingsSignOrderAndOffset) {
  const FreeDPacket packet = parse_freed(freed(9, {30, 0, 0}, {1, 2, 3}, 2500, 0));
  FreeDSettings settings;
  settings.axis = {1, 2, 0};
  settings.sign = {1, -1, 1};
  settings.offset = {10, 0, 0};
  settings.turn_sign = {-1, 1, 1};
  settings.turn_offset = {-60, 0, 0};
  settings.zoom_is_focal_length = true;
  const TrackedPose pose = pose_of(packet, settings);
  EXPECT_EQ(pose.source, "freed 9");
  expect_near(pose.place, {12, -3, 1}, 1e-12);
  expect_near(pose.axes[1], {-1, 0, 0}, 1e-12);  // 90° to the left
  EXPECT_DOUBLE_EQ(pose.focal_length_mm.value(), 25.0);
  settings.axis = {0, 0, 1};
  EXPECT_THROW(pose_of(packet, settings), Error);
}

TEST(FreeD, AThousandPosesWithinItsOwnRounding) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> metre(-100, 100), turn(-180, 180);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 place(metre(random), metre(random), metre(random));
    const Vec3 angles(turn(random), turn(random) / 2, turn(random));
    const TrackedPose pose = pose_of(parse_freed(freed(1, angles, place, 0, 0)), {});
    const Mat3 truth = axes_of_angles(-angles.x, angles.y, angles.z);
    for (int k = 0; k < 3; ++k) {
      EXPECT_LE(std::abs(pose.place[k] - place[k]), 0.5 / 64000.0 + 1e-12);
      // Three angles, each off by half a step at most.
      EXPECT_LE(glm::length(pose.axes[k] - truth[k]), 3 * 0.5 / 32768.0 * M_PI / 180.0 + 1e-12);
    }
  }
}

TEST(FreeD, RefusesEveryOtherByte) {
  const Packet good = freed(1, {12, -7, 3}, {1, 2, 3}, 4, 5);
  EXPECT_NO_THROW(parse_freed(good));
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_THROW(parse_freed({good.data(), size}), Error);
  for (std::size_t at = 0; at < good.size(); ++at)
    for (int flip = 1; flip < 256; ++flip) {
      Packet bad = good;
      bad[at] ^= static_cast<std::uint8_t>(flip);
      EXPECT_THROW(parse_freed(bad), Error) << "byte " << at;
    }
}

TEST(FreeD, AChecksumMayBeLeftOut) {
  Packet packet = freed(89, {12, -7, 3}, {1, 2, 3}, 4, 5);
  packet.back() = 0;
  try {
    parse_freed(packet);
    ADD_FAILURE() << "it was taken";
  } catch (const PacketError& error) {
    EXPECT_NE(std::string(error.what()).find("checksum=zero-is-none"), std::string::npos);
  }
  EXPECT_EQ(parse_freed(packet, FreeDChecksum::zero_is_none).camera, 89);
  EXPECT_EQ(parse_freed(packet, FreeDChecksum::ignored).camera, 89);
  packet.back() = 1;
  EXPECT_THROW(parse_freed(packet, FreeDChecksum::zero_is_none), PacketError);
  EXPECT_EQ(parse_freed(packet, FreeDChecksum::ignored).camera, 89);
}

// Packets one after the other, with line ends, padding and polls around them.
TEST(FreeD, SeveralPacketsInADatagram) {
  const Packet one = freed(1, {1, 0, 0}, {0, 0, 0}, 0, 0),
               two = freed(255, {2, 0, 0}, {0, 0, 0}, 0, 0);
  const Packet poll{0xD0, 0x01, 0xD1, 0x9E}, lines{'\r', '\n'};
  const auto sizes = [&](std::initializer_list<Packet> parts, TrackProtocol protocol) {
    Packet all;
    for (const Packet& part : parts) all.insert(all.end(), part.begin(), part.end());
    std::vector<std::size_t> found;
    std::size_t poses = 0;
    PoseReader reader;
    for (const auto packet : packets_in(all, protocol)) {
      found.push_back(packet.size());
      try {
        poses += reader.read(packet, "a:1", {}).has_value();
      } catch (const Error&) {
      }
    }
    found.push_back(poses);
    return found;
  };
  using Sizes = std::vector<std::size_t>;
  for (const TrackProtocol protocol : {TrackProtocol::automatic, TrackProtocol::freed}) {
    EXPECT_EQ(sizes({one}, protocol), (Sizes{29, 1}));
    EXPECT_EQ(sizes({one, two}, protocol), (Sizes{29, 29, 2}));
    EXPECT_EQ(sizes({one, lines}, protocol), (Sizes{29, 1}));
    EXPECT_EQ(sizes({lines, one, lines, two, Packet(35, 0)}, protocol), (Sizes{29, 29, 2}));
    EXPECT_EQ(sizes({one, Packet(3, 0xFF)}, protocol), (Sizes{29, 1}));
    EXPECT_EQ(sizes({one, Packet{'a', 'b'}}, protocol), (Sizes{29, 1}));
    EXPECT_EQ(sizes({poll, one, poll}, protocol), (Sizes{4, 29, 4, 1}));
    EXPECT_EQ(sizes({one, Packet(two.begin(), two.begin() + 20)}, protocol), (Sizes{29, 20, 1}));
    EXPECT_EQ(sizes({Packet(40, 0)}, protocol), (Sizes{40, 0}));
    EXPECT_EQ(sizes({{}}, protocol), (Sizes{0, 0}));
  }
  // A sample of JSON is one packet, and what stands behind it another.
  const Packet text = json_bytes(sample({0, 0, 0}, {1, 2, 3}));
  EXPECT_EQ(sizes({lines, text, one}, TrackProtocol::automatic), (Sizes{text.size() + 2, 29, 2}));
  EXPECT_EQ(sizes({text}, TrackProtocol::automatic), (Sizes{text.size(), 1}));
}

TEST(FreeD, PollsTellNoPose) {
  PoseReader reader;
  for (const Packet& packet : {Packet{0xD0, 0x01, 0xD1, 0x9E}, Packet{0xD2, 0x01, 0x05, 0x68}})
    EXPECT_FALSE(reader.read(packet, "a:1", {}));
  EXPECT_EQ(reader.polls(), 2u);
  EXPECT_THROW(reader.read(Packet{0xD0, 0x01, 0xD1, 0x9F}, "a:1", {}), Error);
}

TEST(FreeD, AnEncodersValueIsHardlyAFocalLength) {
  for (const double mm : {2.0, 9.5, 29.1, 129.0, 150.0})
    EXPECT_FALSE(doubt_in_focal_length(mm, 0.0));
  EXPECT_FALSE(doubt_in_focal_length(129.0, 5.6));  // the long end of a PTZ head
  EXPECT_FALSE(doubt_in_focal_length(400.0, 36.0));
  EXPECT_TRUE(doubt_in_focal_length(164.0, 13.2));
  EXPECT_TRUE(doubt_in_focal_length(289.0, 13.2));
  EXPECT_TRUE(doubt_in_focal_length(289.0, 0.0));
  EXPECT_TRUE(doubt_in_focal_length(0.5, 13.2));
  // What only a box lens reaches is said as such.
  const auto said = [](double mm) { return doubt_in_focal_length(mm, 9.6).value_or(""); };
  EXPECT_EQ(said(800.0),
            "800 mm (0.7 degrees from side to side), which only long broadcast lenses reach");
  EXPECT_EQ(said(5000.0),
            "5000 mm (0.1 degrees from side to side), which is no lens's focal length");
}

// Zoom and focus are encoders' values, of which a lens file makes a lens.
TEST(FreeD, ALensFileReadsTheEncoders) {
  PoseReaderSettings settings;
  settings.sensor_width_mm = 13.2;
  settings.lens = std::make_shared<const LensTable>(
      "zoom focal_length_mm entrance_pupil_m\n100 10 0.1\n200 30 0.3\n"
      "focus focus_distance_m\n0 1\n1000 inf\n",
      "lens.txt");
  PoseReader reader;
  TrackedPose pose = *reader.read(freed(1, {90, 0, 0}, {1, 2, 3}, 150, 500), "a:1", settings);
  EXPECT_DOUBLE_EQ(pose.focal_length_mm.value(), 20.0);
  EXPECT_DOUBLE_EQ(pose.focus_distance_m.value(), 2.0);
  expect_near(pose.place, {1.2, 2, 3}, 1e-12);  // forward along x
  EXPECT_FALSE(reader.lens_outside());
  EXPECT_EQ(reader.read(freed(1, {90, 0, 0}, {1, 2, 3}, 201, 0), "a:1", settings)->focal_length_mm,
            30.0);
  EXPECT_TRUE(reader.lens_outside());
  // What the packet tells stays.
  settings.freed.zoom_is_focal_length = true;
  pose = *reader.read(freed(1, {90, 0, 0}, {1, 2, 3}, 150, 500), "a:1", settings);
  EXPECT_EQ(pose.focal_length_mm, 1.5);
  EXPECT_DOUBLE_EQ(pose.focus_distance_m.value(), 2.0);
  EXPECT_FALSE(reader.lens_outside());
}

}  // namespace
}  // namespace polyhull
