// SPDX-License-Identifier: LGPL-2.1-or-later
// OpenTrackIO: the published examples' values, senders that differ in what the pages leave open, lenses,
// and values that are left out.
#include <gtest/gtest.h>

#include <cstdio>
#include <limits>

#include "base/error.h"
#include "packets.h"
#include "track/opentrackio_sample.h"
#include "track/packet_error.h"
#include "track/pose_reader.h"
#include "track/track.h"

namespace polyhull {
namespace {

using namespace track_examples;
using nlohmann::json;

void expect_near(const Vec3& a, const Vec3& b, double tolerance = 1e-12) {
  EXPECT_LE(glm::length(a - b), tolerance) << a.x << ' ' << a.y << ' ' << a.z;
}

OpenTrackIOSample read(const json& value) {
  return OpenTrackIOReader().read({OpenTrackIOEncoding::json, {}, json_bytes(value)}, "");
}

// The members and values of the four examples that opentrackio.org publishes with protocol 1.0.0
// (SMPTE/ris-osvp-metadata-camdkit, opentrackio/examples), with an identifier of our own.
json published(bool complete, bool with_static) {
  const json rate{{"num", 24000}, {"denom", 1001}};
  json transform{{"translation", {{"x", 1.0}, {"y", 2.0}, {"z", 3.0}}},
                 {"rotation", {{"pan", 180.0}, {"tilt", 90.0}, {"roll", 45.0}}},
                 {"id", "Camera"}};
  json value{
      {"tracker",
       {{"notes", "Example generated sample."},
        {"recording", false},
        {"slate", "A101_A_4"},
        {"status", "Optical Good"}}},
      {"timing",
       {{"mode", "external"},
        {"sampleRate", rate},
        {"timecode",
         {{"hours", 1}, {"minutes", 2}, {"seconds", 3}, {"frames", 4}, {"frameRate", rate}}}}},
      {"lens",
       {{"distortion",
         {{{"radial", {1.0, 2.0, 3.0}}, {"tangential", {1.0, 2.0}}, {"overscan", 3.1}}}},
        {"encoders", {{"focus", 0.1}, {"iris", 0.2}, {"zoom", 0.3}}},
        {"entrancePupilOffset", 0.123},
        {"fStop", 4.0},
        {"pinholeFocalLength", 24.305},
        {"focusDistance", 10.0},
        {"projectionOffset", {{"x", 0.1}, {"y", 0.2}}}}},
      {"protocol", {{"name", "OpenTrackIO"}, {"version", {1, 0, 0}}}},
      {"sampleId", "urn:uuid:00000000-0000-4000-8000-000000000001"},
      {"sourceId", "urn:uuid:00000000-0000-4000-8000-000000000002"},
      {"sourceNumber", 1},
      {"transforms", {transform}}};
  const json sensor{{"height", 24.0}, {"width", 36.0}};
  if (with_static)
    value["static"] = {{"camera", {{"activeSensorPhysicalDimensions", sensor}, {"label", "A"}}},
                       {"lens", {{"make", "LensMaker"}, {"model", "Model15"}}}};
  if (!complete) return value;
  value["timing"]["mode"] = "internal";
  value["timing"]["recordedTimestamp"] = {{"seconds", 1718806000}, {"nanoseconds", 500000000}};
  value["timing"]["sampleTimestamp"] = {{"seconds", 1718806554}, {"nanoseconds", 500000000}};
  value["timing"]["sequenceNumber"] = 0;
  value["timing"]["synchronization"] = {
      {"locked", true},
      {"source", "ptp"},
      {"frequency", rate},
      {"present", true},
      {"ptp",
       {{"profile", "SMPTE ST2059-2:2021"},
        {"domain", 1},
        {"leaderIdentity", "00:11:22:33:44:55"},
        {"leaderAccuracy", 5e-08},
        {"leaderPriorities", {{"priority1", 128}, {"priority2", 128}}},
        {"leaderTimeSource", "GNSS"},
        {"meanPathDelay", 0.000123},
        {"vlan", 100}}}};
  const json coefficients{1.0, 2.0, 3.0, 4.0, 5.0, 6.0};
  value["lens"].update(
      {{"custom", {1.0, 2.0}},
       {"distortion",
        {{{"model", "Brown-Conrady U-D"},
          {"radial", coefficients},
          {"tangential", {1.0, 2.0}},
          {"overscan", 3.0}},
         {{"radial", coefficients}, {"tangential", {1.0, 2.0}}, {"overscan", 2.0}}}},
       {"distortionOffset", {{"x", 1.0}, {"y", 2.0}}},
       {"exposureFalloff", {{"a1", 1.0}, {"a2", 2.0}, {"a3", 3.0}}},
       {"rawEncoders", {{"focus", 1000}, {"iris", 2000}, {"zoom", 3000}}},
       {"tStop", 4.1}});
  value["globalStage"] = {{"E", 100.0},    {"N", 200.0},    {"U", 300.0},
                          {"lat0", 100.0}, {"lon0", 200.0}, {"h0", 300.0}};
  value["custom"] = {{"pot1", 2435}, {"button1", false}};
  value["relatedSampleIds"] = {"urn:uuid:00000000-0000-4000-8000-000000000003"};
  json scaled = transform;
  scaled["scale"] = {{"x", 1.0}, {"y", 2.0}, {"z", 3.0}};
  value["transforms"] = {transform, scaled, scaled};
  if (with_static) {
    json& camera = value["static"]["camera"];
    camera.update({{"captureFrameRate", rate},
                   {"make", "CameraMaker"},
                   {"model", "Model20"},
                   {"activeSensorResolution", {{"height", 2160}, {"width", 3840}}},
                   {"anamorphicSqueeze", {{"num", 1}, {"denom", 1}}},
                   {"isoSpeed", 4000},
                   {"shutterAngle", 45.0}});
    value["static"]["duration"] = {{"num", 1}, {"denom", 25}};
  }
  return value;
}

void expect_published(const TrackedPose& pose, bool complete, bool with_static) {
  EXPECT_EQ(pose.source, "urn:uuid:00000000-0000-4000-8000-000000000002");
  EXPECT_EQ(pose.focal_length_mm, 24.305);
  EXPECT_EQ(pose.focus_distance_m, 10.0);
  EXPECT_EQ(pose.f_number, 4.0);
  EXPECT_EQ(pose.projection_offset_mm, Vec2(0.1, 0.2));
  EXPECT_EQ(pose.sensor_width_mm, with_static ? std::optional(36.0) : std::nullopt);
  EXPECT_EQ(pose.sensor_height_mm, with_static ? std::optional(24.0) : std::nullopt);
  // By hand. Upwards by 90° after half a turn: forward is z, right -x, up y; rolled by 45°.
  const double c = std::sqrt(0.5);
  if (!complete) {
    expect_near(pose.place, {1.0, 2.0, 3.123});
    expect_near(pose.axes[0], {-c, -c, 0});
    expect_near(pose.axes[1], {0, 0, 1});
    expect_near(pose.axes[2], {-c, c, 0});
    return;
  }
  EXPECT_EQ(pose.capture_time_ns, 1718806554'500000000);
  EXPECT_EQ(pose.sequence, 0);
  // The same turn R three times; with S the scales the place is t + R t + R R S t, and .123 forward.
  expect_near(pose.axes[1], {0.5, 0.5, c});
  expect_near(pose.place, Vec3(6 - 8 * c, 7 + 6 * c, 5 + 8 * c) + 0.123 * Vec3(0.5, 0.5, c));
}

TEST(OpenTrackIO, PublishedExamplesAsTheyArePublished) {
  for (const bool complete : {false, true})
    for (const bool with_static : {false, true})
      for (const int encoding : {1, 2})
        for (const std::size_t part : {100000, 1400, 300}) {
          const json value = published(complete, with_static);
          const Packet bytes = encoding == 1 ? json_bytes(value) : Packet(json::to_cbor(value));
          PoseReader reader;
          std::optional<TrackedPose> pose;
          for (std::size_t begins = 0; begins < bytes.size(); begins += part) {
            EXPECT_FALSE(pose);
            const std::size_t count = std::min(part, bytes.size() - begins);
            pose = reader.read(segment(bytes, encoding, 0, begins, count, 255), "a:1", {});
          }
          ASSERT_TRUE(pose);
          expect_published(*pose, complete, with_static);
          // 1 per square millimetre is no lens's, and neither is a centre of its own.
          EXPECT_TRUE(reader.lens_unread());
          EXPECT_TRUE(reader.unread().empty());
        }
}

// The checksum as Unreal and camdkit's receiver want it, as camdkit's sender writes it, and as the
// protocol's page of 1.0.0 computes it.
TEST(OpenTrackIO, ChecksumsInTheFourFormsThatAreSent) {
  const Packet text = json_bytes(sample({0, 0, 0}, {1, 2, 3}));
  for (const unsigned modulus : {255u, 256u})
    for (const bool swapped : {false, true}) {
      Packet packet = segment(text, 1, 7, 0, text.size(), modulus);
      if (swapped) std::swap(packet[14], packet[15]);
      EXPECT_EQ(parse_opentrackio_packet(packet).sequence, 7);
      packet[14] ^= 1;
      EXPECT_THROW(parse_opentrackio_packet(packet), PacketError);
    }
}

// \p text in three segments, the first one under the number \p first; whether they are numbered each.
std::vector<Packet> in_three(const Packet& text, std::uint16_t first, bool each) {
  std::vector<Packet> packets;
  const std::size_t part = text.size() / 3;
  for (std::uint16_t i = 0; i < 3; ++i) {
    auto number = static_cast<std::uint16_t>(each ? first + i : first);
    if (each && number < first) ++number;  // 0 is left out
    packets.push_back(
        segment(text, 1, number, i * part, i == 2 ? text.size() - 2 * part : part, 255));
  }
  return packets;
}

TEST(OpenTrackIO, SegmentsMayEachHaveTheirOwnNumber) {
  json value = sample({0, 0, 0}, {1, 2, 3});
  PoseReader reader;
  Track track({});
  std::uint16_t number = 65534;  // wraps
  for (unsigned i = 0; i < 20; ++i) {
    value["timing"]["sequenceNumber"] = 100 + i;
    value["transforms"][0]["translation"]["x"] = i;
    const std::vector<Packet> packets = in_three(json_bytes(value), number, true);
    number = static_cast<std::uint16_t>(number > 65000 ? 2 : number + 3);
    EXPECT_FALSE(reader.read(packets[0], "a:1", {}));
    if (i == 7) continue;  // the others are lost
    EXPECT_FALSE(reader.read(packets[1], "a:1", {}));
    if (i == 12) continue;
    const auto pose = reader.read(packets[2], "a:1", {});
    ASSERT_TRUE(pose) << i;
    EXPECT_EQ(pose->place.x, i);
    EXPECT_EQ(pose->sequence, 100 + i);
    EXPECT_TRUE(track.add(*pose, 20'000'000 * i));
  }
  EXPECT_EQ(reader.incomplete(), 2u);
  EXPECT_EQ(track.counters().lost, 2u);
}

// What is left of a sample whose begin is lost must not become another's end, in either way of counting.
TEST(OpenTrackIO, SegmentsOfTwoSamplesAreNotPutTogether) {
  const Packet one = json_bytes(sample({0, 0, 0}, {1, 0, 0}));
  const Packet two = json_bytes(sample({0, 0, 0}, {2, 0, 0}));
  ASSERT_EQ(one.size(), two.size());
  for (const bool each : {false, true}) {
    OpenTrackIOSegments segments;
    const auto add = [&](const Packet& packet) {
      return segments.add(parse_opentrackio_packet(packet)).has_value();
    };
    for (const Packet& packet : in_three(one, 10, each)) add(packet);
    if (each) {
      // The first of its three is lost; the next sample's begin at the second's number, as of a sender
      // that counts samples and segments at once.
      EXPECT_FALSE(add(in_three(one, 13, each)[1]));
      EXPECT_FALSE(add(in_three(one, 13, each)[2]));
      EXPECT_FALSE(add(in_three(two, 14, each)[0]));
      EXPECT_FALSE(add(in_three(two, 14, each)[1]));
      EXPECT_TRUE(add(in_three(two, 14, each)[2]));
    } else {
      // The last two are lost, and the first of the next.
      EXPECT_FALSE(add(in_three(one, 11, each)[0]));
      EXPECT_FALSE(add(in_three(two, 12, each)[1]));
      EXPECT_FALSE(add(in_three(two, 12, each)[2]));
      EXPECT_TRUE(add(in_three(two, 12, each)[0]));
    }
  }
}

// Where segments are counted and samples are not, nothing says that any was lost.
TEST(OpenTrackIO, NumbersOfSegmentsAreNotOfSamples) {
  json value = sample({0, 0, 0}, {1, 2, 3});
  value["timing"].erase("sequenceNumber");
  PoseReader reader;
  for (std::uint16_t number = 10; number < 40; number = static_cast<std::uint16_t>(number + 3))
    for (const Packet& packet : in_three(json_bytes(value), number, true)) {
      const auto pose = reader.read(packet, "a:1", {});
      EXPECT_FALSE(pose && pose->sequence);
    }
}

TEST(OpenTrackIO, ASendersRestIsReadAfterOthersGarbage) {
  const Packet text = json_bytes(sample({0, 0, 0}, {1, 2, 3}));
  PoseReader reader;
  for (const Packet& packet : in_three(text, 5, false)) reader.read(packet, "10.0.0.1:4000", {});
  const std::vector<Packet> next = in_three(text, 6, false);
  EXPECT_FALSE(reader.read(next[0], "10.0.0.1:4000", {}));
  for (int port = 0; port < 100; ++port) {
    const std::string other = "10.0.0.9:" + std::to_string(port);
    Packet bad = next[0];
    bad[20] ^= 1;
    EXPECT_THROW(reader.read(bad, other, {}), PacketError);
    EXPECT_FALSE(reader.read(next[0], other, {}));
    json whole = sample({0, 0, 0}, {1, 2, 3});
    whole["sourceId"] = other;
    EXPECT_TRUE(reader.read(json_bytes(whole), other + "0", {}));
  }
  EXPECT_FALSE(reader.read(next[1], "10.0.0.1:4000", {}));
  EXPECT_TRUE(reader.read(next[2], "10.0.0.1:4000", {}));
}

// Two machines may send under the same name.
TEST(OpenTrackIO, ASensorIsItsMachines) {
  PoseReader reader;
  json value = sample({0, 0, 0}, {1, 2, 3});
  EXPECT_EQ(reader.read(json_bytes(value), "10.0.0.1:4000", {})->sensor_width_mm, 36.0);
  value["static"]["camera"]["activeSensorPhysicalDimensions"]["width"] = 24.0;
  EXPECT_EQ(reader.read(json_bytes(value), "10.0.0.2:4000", {})->sensor_width_mm, 24.0);
  value.erase("static");
  EXPECT_EQ(reader.read(json_bytes(value), "10.0.0.1:5000", {})->sensor_width_mm, 36.0);
}

TEST(OpenTrackIO, VersionsOtherThan1AreRefused) {
  json value = sample({0, 0, 0}, {1, 2, 3});
  for (const json& version : {json{1, 0, 0}, json{1, 9}, json("1.0.1")}) {
    value["protocol"]["version"] = version;
    EXPECT_NO_THROW(read(value)) << version;
  }
  for (const json& version :
       {json{2, 0, 0}, json{0, 9, 1}, json("0.9.1"), json::array(), json(7)}) {
    value["protocol"]["version"] = version;
    EXPECT_THROW(read(value), Error) << version;
  }
  value["protocol"]["version"] = {2, 0, 1};
  try {
    read(value);
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "OpenTrackIO version 2.0.1, expected 1.x.");
  }
  value.erase("protocol");
  EXPECT_NO_THROW(read(value));
}

TEST(OpenTrackIO, OneBadValueIsLeftOutAndSaid) {
  json value = sample({0, 0, 0}, {1, 2, 3});
  value["lens"] = {{"pinholeFocalLength", 24.5}, {"fStop", 2.8}, {"focusDistance", 3.0}};
  const auto without = [&](const char* path, const json& bad) {
    json spoilt = value;
    spoilt[json::json_pointer(path)] = bad;
    const OpenTrackIOSample sample =
        OpenTrackIOReader().read({OpenTrackIOEncoding::cbor, {}, json::to_cbor(spoilt)}, "");
    EXPECT_EQ(sample.pose.place, Vec3(1, 2, 3));
    EXPECT_EQ(sample.unread.size(), 1u) << path;
    return sample.pose;
  };
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(without("/lens/fStop", 0).f_number);
  EXPECT_FALSE(without("/lens/focusDistance", infinite).focus_distance_m);
  EXPECT_FALSE(without("/lens/pinholeFocalLength", "24").focal_length_mm);
  EXPECT_EQ(without("/lens/projectionOffset/x", "1").projection_offset_mm, Vec2(0.0));
  EXPECT_FALSE(without("/timing/sequenceNumber", 1.5).sequence);
  EXPECT_FALSE(without("/timing/sampleTimestamp/nanoseconds", 1.5).capture_time_ns);
  EXPECT_FALSE(without("/timing/sampleTimestamp/nanoseconds", 1000000000).capture_time_ns);
  EXPECT_FALSE(without("/timing/sampleTimestamp/seconds", -1).capture_time_ns);
  EXPECT_EQ(without("/lens/fStop", -1).focus_distance_m, 3.0);
  EXPECT_EQ(without("/static/camera/activeSensorPhysicalDimensions/width", 0).sensor_height_mm,
            24.0);
  EXPECT_EQ(without("/static/camera/anamorphicSqueeze", 2).sensor_width_mm, 36.0);
}

TEST(OpenTrackIO, ASqueezeWidensTheFieldOfView) {
  json value = sample({0, 0, 0}, {1, 2, 3});
  value["lens"]["projectionOffset"] = {{"x", 0.5}, {"y", 0.25}};
  value["static"]["camera"]["anamorphicSqueeze"] = {{"num", 2}, {"denom", 1}};
  OpenTrackIOReader reader;
  const auto camera_now = [&](int width, double pixel_aspect) {
    const OpenTrackIOSample sample =
        reader.read({OpenTrackIOEncoding::json, {}, json_bytes(value)}, "");
    EXPECT_FALSE(sample.lens_unread);
    return camera_of(sample.pose, width, 2400, 1.0, pixel_aspect);
  };
  // 24.5 mm before 36 x 24 mm. Half as many pixels for a length across as for one upwards, as they
  // come from the sensor; as many once the picture is wide.
  const Camera squeezed = camera_now(3600, 2.0);
  EXPECT_NEAR(squeezed.K[0][0], 24.5 / 36 * 3600 / 2, 1e-9);
  EXPECT_NEAR(squeezed.K[1][1], 24.5 / 24 * 2400, 1e-9);
  EXPECT_NEAR(squeezed.K[2][0], 1799.5 + 0.5 / 36 * 3600, 1e-9);
  EXPECT_NEAR(squeezed.K[2][1], 1199.5 + 0.25 / 24 * 2400, 1e-9);
  value.erase("static");  // it holds
  const Camera wide = camera_now(7200, 1.0);
  EXPECT_NEAR(wide.K[0][0], 24.5 / 24 * 2400, 1e-9);
  EXPECT_NEAR(wide.K[1][1], 24.5 / 24 * 2400, 1e-9);
  EXPECT_NEAR(wide.K[2][0], 3599.5 + 0.5 / 36 * 7200, 1e-9);
  // The lens's model is of round lenses.
  value["lens"]["distortion"] = {{{"model", "Brown-Conrady U-D"}, {"radial", {1e-5}}}};
  EXPECT_TRUE(read(value).pose.distortion.size() == 5);
  EXPECT_TRUE(reader.read({OpenTrackIOEncoding::json, {}, json_bytes(value)}, "").lens_unread);
}

// The protocol's default model takes distorted points to undistorted ones: held against its formula all
// over a sensor of 36 x 20.25 mm, in pixels of 1920.
TEST(OpenTrackIO, DistortedToUndistortedWithinATwentiethOfAPixel) {
  const double f = 24.3, width = 36.0, height = 20.25,
               corner = 0.25 * (width * width + height * height);
  json value = sample({0, 0, 0}, {0, 0, 0});
  value["static"]["camera"]["activeSensorPhysicalDimensions"] = {{"width", width},
                                                                 {"height", height}};
  for (const double strength : {-0.1, -0.05, -0.01, 0.0, 0.01, 0.05, 0.1, 0.2}) {
    // At the corner by `strength`; off its axis by .15 pixels at the picture's side.
    const double l1 = 1.2 * strength / corner, l3 = -0.2 * strength / corner / corner;
    const double q1 = 2e-6, q2 = -3e-6;
    value["lens"] = {{"pinholeFocalLength", f},
                     {"distortion", {{{"radial", {l1, 0.0, l3}}, {"tangential", {q1, q2}}}}}};
    for (const bool named : {false, true}) {
      if (named) value["lens"]["distortion"][0]["model"] = "Brown-Conrady D-U";
      const OpenTrackIOSample sample = read(value);
      ASSERT_FALSE(sample.lens_unread) << *sample.lens_unread;
      const Camera camera = camera_of(sample.pose, 1920, 1080, 1.0);
      double worst = 0.0;
      for (double x = -0.5; x <= 0.5; x += 0.013)
        for (double y = -0.5; y <= 0.5; y += 0.017) {
          const Vec2 p(x * width, y * height);  // on the sensor
          const double s = glm::dot(p, p), radial = 1.0 + l1 * s + l3 * s * s;
          const Vec2 ideal(p.x * radial + 2 * q1 * p.x * p.y + q2 * (s + 2 * p.x * p.x),
                           p.y * radial + q1 * (s + 2 * p.y * p.y) + 2 * q2 * p.x * p.y);
          const auto found = camera.project({ideal.x, -ideal.y, -f});
          const Vec2 pixel(p.x / width * 1920 + 959.5, p.y / height * 1080 + 539.5);
          worst = std::max(worst, glm::length(*found - pixel));
        }
      EXPECT_LE(worst, 0.05) << strength;
      if (named) std::printf("a lens of %+.2f: off by up to %.4f pixels\n", strength, worst);
    }
  }
}

// Of a lens that does not distort the model's name, its centre and the rest do not matter.
TEST(OpenTrackIO, CoefficientsOf0AreNoAlarm) {
  json value = sample({0, 0, 0}, {1, 2, 3});
  value["static"]["camera"]["anamorphicSqueeze"] = {{"num", 2}, {"denom", 1}};
  value["lens"] = {{"distortionOffset", {{"x", 0.1}, {"y", 0.0}}}};
  const json zeros{
      {"model", "Brown-Conrady"}, {"radial", {0, 0.0}}, {"tangential", {0}}, {"overscan", 1.1}};
  for (const json& told : {json::array({zeros}), json::array({zeros, {{"model", "X"}}}), zeros}) {
    value["lens"]["distortion"] = told;
    const OpenTrackIOSample sample = read(value);
    EXPECT_FALSE(sample.lens_unread) << *sample.lens_unread;
    EXPECT_EQ(sample.pose.distortion, std::vector<double>(5));
  }
  value["lens"]["distortion"] = json::array({zeros});
  value["lens"]["distortion"][0]["radial"][1] = 1e-9;
  EXPECT_TRUE(read(value).lens_unread);
  value.erase("lens");
  value["lens"] = {{"pinholeFocalLength", 24.5}};
  // A model alone is a list of one.
  value.erase("static");
  value["lens"]["distortion"] = {{"model", "Brown-Conrady U-D"}, {"radial", {1e-5}}};
  EXPECT_NEAR(read(value).pose.distortion.at(0), 1e-5 * 24.5 * 24.5, 1e-12);
}

// By encoders from 0 to 1 or as the tracker counts, where the sample tells no focal length.
TEST(OpenTrackIO, ALensFileReadsTheEncoders) {
  json value = sample({0, 0, 0}, {1, 2, 3});
  value["lens"] = {{"encoders", {{"zoom", 0.5}, {"focus", 0.25}}},
                   {"rawEncoders", {{"zoom", 3000}, {"focus", 1000}}},
                   {"distortion", {{{"model", "Brown-Conrady U-D"}, {"radial", {1e-5}}}}}};
  PoseReader reader;
  const auto read_by = [&](const char* file) {
    PoseReaderSettings settings;
    settings.lens = std::make_shared<const LensTable>(file, "lens.txt");
    return *reader.read(json_bytes(value), "a:1", settings);
  };
  const char* const normalised =
      "zoom focal_length_mm k1 entrance_pupil_m\n0 10 -0.2 0.1\n1 30 -0.2 0.1\n";
  TrackedPose pose = read_by(normalised);
  EXPECT_DOUBLE_EQ(pose.focal_length_mm.value(), 20.0);
  EXPECT_EQ(pose.distortion.at(0), -0.2);
  EXPECT_FALSE(reader.lens_unread());  // the file's stands for it
  expect_near(pose.place, {1, 2.1, 3});
  EXPECT_DOUBLE_EQ(read_by("zoom focal_length_mm\n2000 10\n4000 30\n").focal_length_mm.value(),
                   20.0);
  EXPECT_TRUE(reader.lens_unread());
  EXPECT_DOUBLE_EQ(read_by("focus focus_distance_m\n0 1\n2000 1\n").focus_distance_m.value(), 1.0);
  value["lens"]["entrancePupilOffset"] = 0.5;
  value["lens"]["pinholeFocalLength"] = 7.0;
  pose = read_by(normalised);
  EXPECT_EQ(pose.focal_length_mm, 7.0);
  expect_near(pose.place, {1, 2.5, 3});
  value["lens"]["encoders"].erase("zoom");
  read_by(normalised);
  EXPECT_TRUE(reader.lens_blind());
  // One that is no number is left out and said.
  value["lens"]["encoders"]["zoom"] = "wide";
  read_by(normalised);
  EXPECT_EQ(reader.unread().size(), 1u);
}

TEST(OpenTrackIO, ALensThatCannotBeToldIsSaid) {
  json value = sample({0, 0, 0}, {1, 2, 3});
  value["lens"]["distortion"] = {{{"radial", {-1e-5}}, {"model", "Brown-Conrady U-D"}}};
  EXPECT_FALSE(read(value).lens_unread);
  const auto unread = [&](const char* path, const json& bad) {
    json spoilt = value;
    spoilt[json::json_pointer(path)] = bad;
    const OpenTrackIOSample sample = read(spoilt);
    EXPECT_EQ(sample.pose.place, Vec3(1, 2, 3));
    EXPECT_TRUE(sample.pose.distortion.empty());
    EXPECT_TRUE(sample.lens_unread) << path;
    return sample.lens_unread.value_or("");
  };
  EXPECT_NE(unread("/lens/distortion/0/model", "Fisheye").find("D-U"), std::string::npos);
  EXPECT_NE(unread("/lens/distortionOffset/x", 0.1).find("distortionOffset"), std::string::npos);
  unread("/lens/distortion/0/radial", "none");
  unread("/lens/distortion", 7);
  unread("/lens/pinholeFocalLength", 0);
  value["lens"]["distortion"][0]["model"] = "Brown-Conrady D-U";
  EXPECT_FALSE(read(value).lens_unread);
  EXPECT_NE(unread("/lens/distortion/0/radial", json{1.0, 2.0, 3.0}).find("no lens's"),
            std::string::npos);
  unread("/lens/distortion/0/radial", json{1e300, 2.0, 3.0});
}

}  // namespace
}  // namespace polyhull
