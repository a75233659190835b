// SPDX-License-Identifier: LGPL-2.1-or-later
// OpenTrackIO: values decoded, segments put together, broken packets refused.
#include "packets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <random>

#include "base/error.h"
#include "track/opentrackio_sample.h"
#include "track/packet_error.h"
#include "track/pose_reader.h"

namespace polyhull {
namespace {

using namespace track_examples;

TrackedPose opentrackio_pose(OpenTrackIOSegments& segments, const Packet& packet) {
  const auto sample = segments.add(parse_opentrackio_packet(packet));
  if (!sample) throw Error(Error::Kind::bad_input, "not yet whole");
  return pose_in(*sample);
}

void expect_near(const Vec3& a, const Vec3& b, double tolerance) {
  EXPECT_LE(glm::length(a - b), tolerance);
}

TEST(OpenTrackIO, ReadsASampleInEachEncodingAndWithoutHeader) {
  const nlohmann::json value = sample({90, 30, 0}, {1.5, -2.25, 3.125});
  const Packet cbor = nlohmann::json::to_cbor(value), text = json_bytes(value);
  const std::string indented = value.dump(2);
  const auto behind = [](const char* begin, const auto& bytes) {
    Packet packet(begin, begin + std::strlen(begin));
    packet.insert(packet.end(), bytes.begin(), bytes.end());
    return packet;
  };
  const Packet marked = behind("\xEF\xBB\xBF", text), tagged = behind("\xD9\xD9\xF7", cbor);
  for (const Packet& packet :
       {text, cbor, tagged, marked, behind("", indented), behind("\r\n", indented),
        behind("\xEF\xBB\xBF\n ", indented), segment(marked, 1, 700, 0, marked.size(), 255),
        segment(tagged, 2, 700, 0, tagged.size(), 255), segment(text, 1, 700, 0, text.size(), 255),
        segment(text, 1, 700, 0, text.size(), 256), segment(cbor, 2, 700, 0, cbor.size(), 255),
        segment(cbor, 2, 700, 0, cbor.size(), 256)}) {
    OpenTrackIOSegments segments;
    ASSERT_TRUE(is_opentrackio(packet));
    const TrackedPose pose = opentrackio_pose(segments, packet);
    EXPECT_EQ(pose.source, "urn:uuid:00000000-0000-4000-8000-000000000007");
    EXPECT_EQ(pose.sequence, 41);  // the sample's own, not the header's 700
    EXPECT_EQ(pose.capture_time_ns, 1718806554'500000000);
    EXPECT_EQ(pose.place, Vec3(1.5, -2.25, 3.125));
    // Pan is right-handed about z: 90° look along -x.
    expect_near(pose.axes[1], {-std::cos(M_PI / 6), 0, 0.5}, 1e-12);
    EXPECT_EQ(pose.focal_length_mm, 24.5);
    EXPECT_EQ(pose.sensor_width_mm, 36.0);
    EXPECT_EQ(pose.sensor_height_mm, 24.0);
  }
}

// One behind another, a line each, with what some senders leave behind the last.
TEST(OpenTrackIO, SeveralSamplesOfBareJsonInADatagram) {
  std::string one = sample({90, 30, 0}, {1, 2, 3}).dump();
  one.insert(1, R"("custom": "}{ \" [", )");
  const auto poses = [](const std::string& text, TrackProtocol protocol) {
    const Packet datagram(text.begin(), text.end());
    std::size_t found = 0, refused = 0;
    PoseReader reader;
    for (const auto packet : packets_in(datagram, protocol)) try {
        found += reader.read(packet, "a:1", {.protocol = protocol}).has_value();
      } catch (const Error&) {
        ++refused;
      }
    return 10 * found + refused;
  };
  for (const TrackProtocol protocol : {TrackProtocol::automatic, TrackProtocol::opentrackio}) {
    EXPECT_EQ(poses(one, protocol), 10u);
    EXPECT_EQ(poses("\n" + one + "\r\n" + one + "\n" + std::string(9, '\0'), protocol), 20u);
    EXPECT_EQ(poses(one + one + one.substr(0, 40), protocol), 21u);
    EXPECT_EQ(poses(one.substr(0, one.size() - 1), protocol), 1u);
    EXPECT_EQ(poses(std::string(5000, '{') + "}", protocol), 1u);
  }
}

TEST(OpenTrackIO, PlacesTheEntrancePupilAndChainsTransforms) {
  nlohmann::json value = sample({90, 0, 0}, {0, 0, 2});
  value["transforms"].push_back({{"translation", {{"x", 0.0}, {"y", 1.0}, {"z", 0.0}}},
                                 {"rotation", {{"pan", -90.0}, {"tilt", 0.0}, {"roll", 0.0}}}});
  value["lens"]["entrancePupilOffset"] = 0.125;
  OpenTrackIOSegments segments;
  const TrackedPose pose = opentrackio_pose(segments, json_bytes(value));
  expect_near(pose.place, {-1, 0.125, 2}, 1e-12);
  expect_near(pose.axes[1], {0, 1, 0}, 1e-12);
}

// By the formulas of the group's paper, in mm on the sensor with y down.
TEST(OpenTrackIO, TellsTheLens) {
  nlohmann::json value = sample({0, 0, 0}, {0, 0, 0});
  value["static"]["camera"]["activeSensorPhysicalDimensions"] = {{"width", 36.0},
                                                                 {"height", 20.25}};
  value["lens"] = nlohmann::json::parse(R"({
    "pinholeFocalLength": 24.3, "focusDistance": 3.5, "fStop": 2.8,
    "projectionOffset": {"x": 0.1, "y": -0.2},
    "distortion": [{"radial": [9.0]},
                   {"model": "Brown-Conrady U-D", "tangential": [2e-5, -3e-5],
                    "radial": [-1e-4, 2e-5, 3e-8, -1e-8, 2e-11, 1e-11]}]})");
  OpenTrackIOSegments segments;
  TrackedPose pose = opentrackio_pose(segments, json_bytes(value));
  EXPECT_EQ(pose.focus_distance_m, 3.5);
  EXPECT_EQ(pose.f_number, 2.8);
  const Camera camera = camera_of(pose, 3840, 2160, 1.0);
  for (const Vec2 p : {Vec2(0.0, 0.0), Vec2(5.0, -4.0), Vec2(-12.0, 7.0)}) {
    const double s = p.x * p.x + p.y * p.y;
    const double radial = (1.0 - 1e-4 * s + 3e-8 * s * s + 2e-11 * s * s * s) /
                          (1.0 + 2e-5 * s - 1e-8 * s * s + 1e-11 * s * s * s);
    const Vec2 distorted(p.x * radial + 2 * 2e-5 * p.x * p.y - 3e-5 * (s + 2 * p.x * p.x),
                         p.y * radial + 2e-5 * (s + 2 * p.y * p.y) - 2 * 3e-5 * p.x * p.y);
    // Along the scene's -z, x to the right and y up.
    const std::optional<Vec2> found = camera.project({p.x, -p.y, -24.3});
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->x, (distorted.x + 0.1) / 36.0 * 3840 + 1919.5, 1e-9);
    EXPECT_NEAR(found->y, (distorted.y - 0.2) / 36.0 * 3840 + 1079.5, 1e-9);
  }
  pose.distortion = {1, 2};
  EXPECT_THROW(camera_of(pose, 3840, 2160, 1.0), Error);
}

TEST(OpenTrackIO, AThousandPosesExactly) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> metre(-100, 100), turn(-180, 180);
  OpenTrackIOSegments segments;
  for (std::uint16_t i = 0; i < 1000; ++i) {
    const Vec3 place(metre(random), metre(random), metre(random));
    const nlohmann::json value = sample({turn(random), turn(random), turn(random)}, place);
    const Packet bytes = i % 2 ? nlohmann::json::to_cbor(value) : json_bytes(value);
    const Packet packet = segment(bytes, i % 2 ? 2 : 1, i, 0, bytes.size(), 255);
    expect_near(opentrackio_pose(segments, packet).place, place, 1e-6);
  }
}

TEST(OpenTrackIO, PutsSegmentsTogetherInAnyOrder) {
  const Packet text = json_bytes(sample({0, 0, 0}, {1, 2, 3}));
  std::vector<std::size_t> order{0, 1, 2, 3};
  std::uint16_t sequence = 65530;  // wraps
  OpenTrackIOSegments segments;
  do {
    const std::size_t part = text.size() / 4;
    int whole = 0;
    for (const std::size_t i : order) {
      const std::size_t count = i == 3 ? text.size() - 3 * part : part;
      const Packet packet = segment(text, 1, sequence, i * part, count, 255);
      for (int twice = 0; twice < 2; ++twice)
        if (const auto done = segments.add(parse_opentrackio_packet(packet))) {
          ++whole;
          EXPECT_EQ(done->bytes, text);
        }
    }
    EXPECT_EQ(whole, 1);
    ++sequence;
  } while (std::next_permutation(order.begin(), order.end()));
  EXPECT_EQ(segments.incomplete(), 0u);
  EXPECT_EQ(segments.late(), 0u);
}

TEST(OpenTrackIO, CountsLostAndLateSegments) {
  const Packet text = json_bytes(sample({0, 0, 0}, {1, 2, 3}));
  OpenTrackIOSegments segments;
  const auto add = [&](std::uint16_t sequence, std::size_t begins, std::size_t count) {
    const Packet packet = segment(text, 1, sequence, begins, count, 256);
    return segments.add(parse_opentrackio_packet(packet)).has_value();
  };
  EXPECT_FALSE(add(5, 0, 100));
  EXPECT_FALSE(add(6, 0, 100));  // 5 is given up
  EXPECT_EQ(segments.incomplete(), 1u);
  EXPECT_FALSE(add(5, 100, text.size() - 100));
  EXPECT_EQ(segments.late(), 1u);
  EXPECT_TRUE(add(6, 100, text.size() - 100));
  EXPECT_THROW(add(7, 100, text.size() - 100) || add(7, 50, 100) || add(7, 0, 60), Error);
  EXPECT_EQ(segments.incomplete(), 2u);
}

// What overlaps, or comes in crumbs, is refused as it comes: a flood must not fill the memory.
TEST(OpenTrackIO, KeepsNoMoreThanASample) {
  const Packet bytes(5000, 'x');
  const auto taken = [&](std::size_t step, std::size_t size) {
    OpenTrackIOSegments segments;
    std::size_t kept = 0;
    try {
      for (; kept * step + size < bytes.size(); ++kept)
        segments.add(parse_opentrackio_packet(segment(bytes, 1, 3, kept * step, size, 255)));
    } catch (const Error&) {
    }
    return kept;
  };
  EXPECT_EQ(taken(1, 2000), 1u);
  EXPECT_EQ(taken(4, 4), OpenTrackIOSegments::most_parts);
  EXPECT_EQ(taken(50, 50), 99u);
  OpenTrackIOSegments backwards;
  backwards.add(parse_opentrackio_packet(segment(bytes, 1, 3, 1000, 1000, 255)));
  EXPECT_THROW(backwards.add(parse_opentrackio_packet(segment(bytes, 1, 3, 900, 101, 255))), Error);
}

TEST(OpenTrackIO, ASenderThatBeginsAnewIsReadAtOnce) {
  const Packet text = json_bytes(sample({0, 0, 0}, {1, 2, 3}));
  OpenTrackIOSegments segments;
  const auto add = [&](std::uint16_t sequence, std::size_t begins, std::size_t count) {
    return segments.add(parse_opentrackio_packet(segment(text, 1, sequence, begins, count, 255)));
  };
  EXPECT_FALSE(add(7000, 0, 100));  // it ends here, in the middle of a sample
  EXPECT_FALSE(add(0, 0, 100));
  EXPECT_TRUE(add(0, 100, text.size() - 100));
  EXPECT_FALSE(add(1, 0, 100));
  EXPECT_TRUE(add(1, 100, text.size() - 100));
}

// `static` need not be in each sample.
TEST(OpenTrackIO, ASensorHoldsForItsSource) {
  PoseReader reader;
  const auto width = [&](const char* source, std::optional<double> sensor) {
    nlohmann::json value = sample({0, 0, 0}, {1, 2, 3});
    value["sourceId"] = source;
    value.erase("static");
    if (sensor) value["static"]["camera"]["activeSensorPhysicalDimensions"]["width"] = *sensor;
    const Packet text = json_bytes(value);
    const auto pose = reader.read(segment(text, 1, 1, 0, text.size(), 255), source, {});
    return pose->sensor_width_mm;
  };
  EXPECT_EQ(width("a", {}), std::nullopt);
  EXPECT_EQ(width("a", 36.0), 36.0);
  EXPECT_EQ(width("a", {}), 36.0);
  EXPECT_EQ(width("b", {}), std::nullopt);
  EXPECT_EQ(width("a", 24.0), 24.0);
  EXPECT_EQ(width("a", {}), 24.0);
}

TEST(OpenTrackIO, RefusesEachFault) {
  const auto refuses = [](const std::function<void(nlohmann::json&)>& spoil) {
    nlohmann::json value = sample({0, 0, 0}, {1, 2, 3});
    spoil(value);
    OpenTrackIOSegments segments;
    EXPECT_THROW(opentrackio_pose(segments, json_bytes(value)), Error) << value.dump();
  };
  refuses([](auto& v) { v.erase("transforms"); });
  refuses([](auto& v) { v["transforms"] = nlohmann::json::array(); });
  refuses([](auto& v) { v["transforms"][0] = 7; });
  refuses([](auto& v) { v["transforms"][0]["translation"].erase("x"); });
  refuses([](auto& v) { v["transforms"][0]["rotation"]["pan"] = "90"; });
  refuses([](auto& v) { v["transforms"][0]["scale"] = {{"x", 0}, {"y", 1}, {"z", 1}}; });
  refuses([](auto& v) { v["transforms"][0]["scale"] = {{"x", -1}, {"y", 1}, {"z", 1}}; });
  refuses([](auto& v) { v["lens"]["entrancePupilOffset"] = "none"; });
  refuses([](auto& v) { v["sourceId"] = std::string(257, 'a'); });
}

TEST(OpenTrackIO, RefusesDeepNesting) {
  for (const std::uint8_t opens : {0x81, 0x9F, 0x7F, 0x5F, 0xBF}) {
    const Packet deep(60000, opens);
    EXPECT_THROW(pose_in({OpenTrackIOEncoding::cbor, {}, deep}), Error);
  }
  EXPECT_THROW(pose_in({OpenTrackIOEncoding::json, {}, Packet(60000, '[')}), Error);
}

TEST(OpenTrackIO, SurvivesMutations) {
  const nlohmann::json value = sample({10, 20, 30}, {1, 2, 3});
  const Packet cbor = nlohmann::json::to_cbor(value), text = json_bytes(value);
  std::mt19937 random(3);
  OpenTrackIOSegments segments;
  int refused = 0;
  for (int i = 0; i < 20000; ++i) {
    const bool is_cbor = i % 2;
    Packet bytes = is_cbor ? cbor : text;
    for (unsigned flips = random() % 4; flips > 0; --flips)
      bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    const std::size_t begins = random() % 3 ? 0 : random() % bytes.size();
    Packet packet = segment(bytes, is_cbor ? 2 : 1, static_cast<std::uint16_t>(random() % 8),
                            begins, random() % (bytes.size() - begins + 1), 255);
    if (random() % 2 == 0) packet = segment(bytes, is_cbor ? 2 : 1, 9, 0, bytes.size(), 255);
    if (random() % 4 == 0) packet[random() % packet.size()] ^= 1;
    if (random() % 4 == 0) packet.resize(random() % packet.size());
    try {
      const auto done = segments.add(parse_opentrackio_packet(packet));
      if (!done) continue;
      const TrackedPose pose = pose_in(*done);
      for (int k = 0; k < 3; ++k) EXPECT_TRUE(std::isfinite(pose.place[k]));
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000);
}

TEST(TrackedCamera, LooksFromWhereTheTrackerSays) {
  TrackedPose pose;
  pose.place = {1, 2, 3};
  pose.axes = axes_of_angles(0, 0, 0);
  const Camera camera = camera_of(pose, 640, 480, 90.0);
  // Along the tracker's +y, the scene's -z; up is the scene's +y.
  const auto seen = [&](const Vec3& scene) { return camera.R * scene + camera.t; };
  expect_near(seen({1, 3, -2}), {0, 0, 0}, 1e-12);
  expect_near(seen({1, 3, -7}), {0, 0, 5}, 1e-12);
  expect_near(seen({2, 4, -2}), {1, -1, 0}, 1e-12);
  EXPECT_NEAR(camera.K[1][1], 240.0, 1e-9);
  EXPECT_NEAR(glm::determinant(camera.R), 1.0, 1e-12);
  pose.focal_length_mm = 18.0;
  pose.sensor_height_mm = 24.0;
  EXPECT_NEAR(camera_of(pose, 640, 480, 90.0).K[0][0], 360.0, 1e-9);
  pose.sensor_width_mm = 36.0;
  EXPECT_NEAR(camera_of(pose, 640, 480, 90.0).K[0][0], 320.0, 1e-9);
  // Pixels a fifth wider than high: more of them stand on each other than side by side.
  EXPECT_NEAR(camera_of(pose, 640, 480, 90.0, 1.2).K[0][0], 320.0, 1e-9);
  EXPECT_NEAR(camera_of(pose, 640, 480, 90.0, 1.2).K[1][1], 384.0, 1e-9);
  EXPECT_NEAR(camera_of({}, 640, 480, 90.0, 1.2).K[0][0], 200.0, 1e-9);
  EXPECT_NEAR(camera_of({}, 640, 480, 90.0, 1.2).K[1][1], 240.0, 1e-9);
  pose.focal_length_mm = -1.0;
  EXPECT_THROW(camera_of(pose, 640, 480, 90.0), Error);
  EXPECT_THROW(camera_of({}, 0, 480, 90.0), Error);
  EXPECT_THROW(camera_of({}, 640, 480, 90.0, 0.0), Error);
  EXPECT_THROW(camera_of({}, 640, 480, 180.0), Error);
}

}  // namespace
}  // namespace polyhull
