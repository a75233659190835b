// SPDX-License-Identifier: LGPL-2.1-or-later
// Packets in files, poses as messages, and packets of several senders as poses.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "base/error.h"
#include "packets.h"
#include "support/folder.h"
#include "track/packet_error.h"
#include "track/packet_file.h"
#include "track/pose_message.h"
#include "track/pose_reader.h"

namespace polyhull {
namespace {

using namespace track_examples;

void add_word(std::string& file, std::size_t value) {
  for (int i = 0; i < 4; ++i) file += static_cast<char>(value >> (8 * i));
}

// The head of a capture of tcpdump's from such a link.
std::string capture_of(int link) {
  std::string file("\xD4\xC3\xB2\xA1\x02\0\x04\0\0\0\0\0\0\0\0\0\xFF\xFF\0\0", 20);
  add_word(file, static_cast<std::size_t>(link));
  return file;
}

void add_frame(std::string& capture, std::uint32_t microseconds, const std::string& frame) {
  add_word(capture, 1'700'000'000);
  add_word(capture, microseconds);
  add_word(capture, frame.size());
  add_word(capture, frame.size());
  capture += frame;
}

class PacketFiles : public testing::Test {
 protected:
  std::string path(const char* name) const { return folder_.file(name); }
  std::string write(const char* name, const std::string& bytes) const {
    std::ofstream(path(name), std::ios::binary) << bytes;
    return path(name);
  }
  std::string recorded(const char* name, int count) const {
    PacketRecorder recorder(path(name), 55555);
    for (int i = 0; i < count; ++i)
      recorder.write({10'000'001ll * i, 0x7F000001, static_cast<std::uint16_t>(4000 + i),
                      freed(1, {0.0, 0.0, 0.0}, {0.001 * i, 0.0, 0.0}, 0, 0)});
    return path(name);
  }
  static std::string content(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

 private:
  const test::Folder folder_;
};

TEST_F(PacketFiles, HoldWhatWasWritten) {
  PacketRecording recording(recorded("a.pcap", 100));
  for (int i = 0; i < 100; ++i) {
    const auto datagram = recording.next();
    ASSERT_TRUE(datagram);
    EXPECT_EQ(datagram->time_ns, 10'000'001ll * i);
    EXPECT_EQ(datagram->sender(), "127.0.0.1:" + std::to_string(4000 + i));
    EXPECT_EQ(datagram->bytes, freed(1, {0.0, 0.0, 0.0}, {0.001 * i, 0.0, 0.0}, 0, 0));
  }
  EXPECT_FALSE(recording.next());
  EXPECT_FALSE(recording.next());
  EXPECT_EQ(recording.skipped(), 0u);
}

TEST_F(PacketFiles, EveryCutLeavesWhatIsWhole) {
  const std::string whole = content(recorded("a.pcap", 4));
  const std::size_t header = 24, record = 16 + 28 + 29;
  ASSERT_EQ(whole.size(), header + 4 * record);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const std::string cut = write("cut.pcap", whole.substr(0, size));
    if (size < header) {
      EXPECT_THROW(PacketRecording{cut}, Error);
      continue;
    }
    PacketRecording recording(cut);
    std::size_t count = 0;
    bool damaged = false;
    try {
      while (recording.next()) ++count;
    } catch (const Error&) {
      damaged = true;
    }
    EXPECT_EQ(count, (size - header) / record);
    EXPECT_EQ(damaged, (size - header) % record != 0);
    EXPECT_FALSE(recording.next());
  }
}

TEST_F(PacketFiles, DamageEndsInAnErrorOrALeftOutPacket) {
  const std::string whole = content(recorded("a.pcap", 4));
  std::mt19937 random(3);
  for (int round = 0; round < 600; ++round) {
    std::string bad = whole;
    for (int i = 0; i < 3; ++i) bad[random() % bad.size()] = static_cast<char>(random());
    try {
      PacketRecording recording(write("bad.pcap", bad));
      int count = 0;
      while (recording.next()) ASSERT_LE(++count, 4);
    } catch (const Error&) {
    }
  }
}

TEST_F(PacketFiles, CapturesOfOtherProgramsCountFromTheirFirstPacket) {
  // Ethernet with and without a tag, dates, something that is not IP, and a piece of a packet.
  std::string file = capture_of(1);
  const std::string raw = content(recorded("a.pcap", 1)).substr(24 + 16);
  const auto add = [&](std::uint32_t microseconds, const std::string& frame) {
    add_frame(file, microseconds, frame);
  };
  const std::string addresses(12, '\x02');
  std::string piece = raw;
  piece[6] = 0x20;
  add(500'000, addresses + std::string("\x08\x00", 2) + raw);
  add(500'010, addresses + std::string("\x08\x06", 2) + raw);
  add(500'020, addresses + std::string("\x08\x00", 2) + piece);
  add(510'000, addresses + std::string("\x81\x00\x00\x01\x08\x00", 6) + raw + "padding");
  PacketRecording recording(write("ethernet.pcap", file));
  EXPECT_EQ(recording.next()->time_ns, 0);
  const auto second = recording.next();
  EXPECT_EQ(second->time_ns, 10'000'000);
  EXPECT_EQ(second->bytes.size(), freed_packet_size);
  EXPECT_FALSE(recording.next());
  EXPECT_EQ(recording.skipped(), 2u);
}

TEST_F(PacketFiles, LoopbackAndIpv6) {
  const std::string raw = content(recorded("a.pcap", 1)).substr(24 + 16);
  const std::string datagram = raw.substr(20);
  std::string ipv6("\x60\0\0\0\0\x25\x11\x40", 8);
  ipv6 += std::string("\xFE\x80\0\0\0\0\0\0\0\0\0\0\0\0\0\x01", 16) + std::string(16, '\x02') +
          datagram;
  const std::string addresses(12, '\x02'), nobody(20, '\0');
  struct Link {
    int number;
    std::string of_ipv4, of_ipv6;
  };
  const Link links[] = {
      {0, std::string("\x02\0\0\0", 4), std::string("\x1E\0\0\0", 4)},    // Npcap, macOS
      {108, std::string("\0\0\0\x02", 4), std::string("\0\0\0\x18", 4)},  // OpenBSD
      {1, addresses + std::string("\x08\0", 2), addresses + "\x86\xDD"},
      {101, "", ""},
      {276, std::string("\x08\0", 2) + nobody.substr(2), "\x86\xDD" + nobody.substr(2)}};
  for (const Link& link : links) {
    std::string file = capture_of(link.number);
    add_frame(file, 0, link.of_ipv4 + raw);
    add_frame(file, 0, link.of_ipv6 + ipv6);
    for (std::size_t size = 0; size < ipv6.size(); ++size)
      add_frame(file, 0, link.of_ipv6 + ipv6.substr(0, size));
    PacketRecording recording(write("link.pcap", file));
    const auto first = recording.next(), second = recording.next();
    ASSERT_TRUE(first && second) << link.number;
    EXPECT_EQ(first->sender(), "127.0.0.1:4000");
    EXPECT_EQ(second->sender(), "[fe80::1]:4000");
    EXPECT_EQ(second->bytes, first->bytes);
    EXPECT_FALSE(recording.next());
    EXPECT_EQ(recording.skipped(), ipv6.size());
  }
  EXPECT_THROW(PacketRecording(write("other.pcap", capture_of(147))), Error);
}

TEST_F(PacketFiles, WhatCannotBeOpenedOrWrittenIsSaid) {
  EXPECT_THROW(PacketRecording("/nowhere/a.pcap"), Error);
  EXPECT_THROW(PacketRecording(std::filesystem::temp_directory_path().string()), Error);
  EXPECT_THROW(PacketRecording(write("text", "this is text, and no recorded track at all")), Error);
  EXPECT_THROW(PacketRecorder("/nowhere/a.pcap", 1), Error);
  const auto fill = [] {
    PacketRecorder full("/dev/full", 1);
    for (int i = 0; i < 3; ++i) full.write({0, 0, 0, Packet(29)});
  };
  EXPECT_THROW(fill(), Error);
}

TEST(PoseMessage, ThousandPosesComeBack) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> metre(-100, 100), turn(-180, 180);
  for (int i = 0; i < 1000; ++i) {
    PoseMessage sent;
    sent.pose.source = "freed 3";
    sent.pose.place = {metre(random), metre(random), metre(random)};
    sent.pose.axes = axes_of_angles(turn(random), turn(random), turn(random));
    if (i % 2 == 0) sent.pose.focal_length_mm = 10.0 + i;
    if (i % 3 == 0) sent.pose.sensor_height_mm = 20.25;
    if (i % 5 == 0) sent.pose.projection_offset_mm = {0.1 * i, -0.2};
    if (i % 7 == 0) sent.pose.distortion = {metre(random), metre(random), metre(random), 1e-5, 0.3};
    if (i % 11 == 0) sent.pose.focus_distance_m = 0.5 * (i + 1);
    if (i % 13 == 0) sent.pose.f_number = 2.8;
    sent.prediction_ns = i;
    const PoseMessage came = parse_pose_message(pose_message_to_json(sent));
    EXPECT_EQ(came.pose.source, "freed 3");
    EXPECT_LE(glm::length(came.pose.place - sent.pose.place), 1e-12);
    for (int k = 0; k < 3; ++k)
      EXPECT_LE(glm::length(came.pose.axes[k] - sent.pose.axes[k]), 1e-14);
    EXPECT_EQ(came.pose.focal_length_mm, sent.pose.focal_length_mm);
    EXPECT_EQ(came.pose.sensor_width_mm, sent.pose.sensor_width_mm);
    EXPECT_EQ(came.pose.sensor_height_mm, sent.pose.sensor_height_mm);
    EXPECT_EQ(came.pose.projection_offset_mm, sent.pose.projection_offset_mm);
    EXPECT_EQ(came.pose.distortion, sent.pose.distortion);
    EXPECT_EQ(came.pose.focus_distance_m, sent.pose.focus_distance_m);
    EXPECT_EQ(came.pose.f_number, sent.pose.f_number);
    EXPECT_EQ(came.prediction_ns, i);
  }
}

TEST(PoseMessage, RefusesWhatIsNone) {
  const std::string rotation = R"("R":[1,0,0,0,1,0,0,0,1])", place = R"("t":[0,1,2])";
  const auto message = [](const std::string& members) {
    return R"({"format":"polyhull-camera","version":1,)" + members + "}";
  };
  EXPECT_EQ(parse_pose_message(message(rotation + "," + place + R"(,"new":1)")).pose.source, "");
  for (const std::string& text :
       {std::string(), std::string("[]"), std::string(R"({"format":"polyhull-camera"})"),
        message(rotation), message(place), message(R"("R":[2,0,0,0,1,0,0,0,1],)" + place),
        message(R"("R":[1,0,0,0,1,0,0,0,-1],)" + place), message(rotation + R"(,"t":[0,1])"),
        message(rotation + R"(,"t":[0,1,1e999])"), message(rotation + R"(,"t":[0,1,"2"])"),
        message(rotation + "," + place + R"(,"focal_length_mm":0)"),
        message(rotation + "," + place + R"(,"distortion":[1,2,3])"),
        message(rotation + "," + place + R"(,"distortion":[1,2,3,"4"])"),
        message(rotation + "," + place + R"(,"projection_offset_mm":1)"),
        message(rotation + "," + place + R"(,"f_number":-1)"),
        message(rotation + "," + place + R"(,"prediction_ns":-1)"),
        message(rotation + "," + place + R"(,"prediction_ns":1e30)")})
    EXPECT_THROW(parse_pose_message(text), Error) << text;
}

TEST(PoseReader, TellsProtocolsAndSendersApart) {
  PoseReader reader;
  PoseReaderSettings settings;
  settings.sensor_width_mm = 30.0;
  const auto pose = reader.read(freed(4, {0, 0, 0}, {1, 2, 3}, 0, 0), "a", settings);
  EXPECT_EQ(pose->source, "freed 4");
  EXPECT_EQ(pose->sensor_width_mm, 30.0);
  // Two senders whose segments come in turns, under the same numbers.
  const Packet one = json_bytes(sample({0, 0, 0}, {1, 0, 0}));
  const Packet two = json_bytes(sample({0, 0, 0}, {2, 0, 0}));
  EXPECT_FALSE(reader.read(segment(one, 1, 9, 0, 100, 255), "a", settings));
  EXPECT_FALSE(reader.read(segment(two, 1, 9, 0, 100, 255), "b", settings));
  EXPECT_EQ(reader.read(segment(one, 1, 9, 100, one.size() - 100, 255), "a", settings)->place.x,
            1.0);
  const auto second = reader.read(segment(two, 1, 9, 100, two.size() - 100, 255), "b", settings);
  EXPECT_EQ(second->place.x, 2.0);
  EXPECT_EQ(second->sensor_width_mm, 36.0);
  EXPECT_EQ(reader.incomplete(), 0u);
}

TEST(PoseReader, SaysWhatIsWrongAndKeepsNoMoreThanItMay) {
  PoseReader reader;
  const auto fault = [&](const Packet& packet, TrackProtocol protocol) {
    PoseReaderSettings settings;
    settings.protocol = protocol;
    try {
      reader.read(packet, "a", settings);
    } catch (const PacketError& error) {
      return error.fault() == PacketError::Fault::truncated ? "truncated" : "checksum";
    } catch (const Error&) {
      return "refused";
    }
    return "none";
  };
  Packet packet = freed(1, {0, 0, 0}, {0, 0, 0}, 0, 0);
  EXPECT_STREQ(fault(packet, TrackProtocol::automatic), "none");
  EXPECT_STREQ(fault(packet, TrackProtocol::opentrackio), "refused");
  packet[5] ^= 1;
  EXPECT_STREQ(fault(packet, TrackProtocol::automatic), "checksum");
  packet.pop_back();
  EXPECT_STREQ(fault(packet, TrackProtocol::automatic), "truncated");
  EXPECT_STREQ(fault({}, TrackProtocol::automatic), "refused");
  EXPECT_STREQ(fault({0}, TrackProtocol::automatic), "refused");
  const Packet text = json_bytes(sample({0, 0, 0}, {1, 0, 0}));
  Packet whole = segment(text, 1, 1, 0, text.size(), 255);
  whole[20] ^= 1;
  EXPECT_STREQ(fault(whole, TrackProtocol::automatic), "checksum");
  whole.pop_back();
  EXPECT_STREQ(fault(whole, TrackProtocol::automatic), "truncated");
  // First segments from a thousand senders.
  for (int i = 0; i < 1000; ++i)
    EXPECT_FALSE(reader.read(segment(text, 1, 1, 0, 100, 255), std::to_string(i), {}));
  EXPECT_EQ(reader.read(segment(text, 1, 1, 100, text.size() - 100, 255), "999", {})->place.x, 1.0);
}

}  // namespace
}  // namespace polyhull
