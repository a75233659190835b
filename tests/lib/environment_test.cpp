// SPDX-License-Identifier: LGPL-2.1-or-later
// Pictures of the light from all around: as files, as what lights, and cut into lights.
#include "environment/environment.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <string>

#include "base/error.h"
#include "base/picture.h"
#include "environment_picture.h"
#include "raytrace/sampling.h"
#include "support/folder.h"
#include "support/refusal.h"
#include "support/run_kind.h"

namespace polyhull {
namespace {

using test::even_environment;
using test::hdr_bytes;
using test::outdoors;

constexpr double pi = std::numbers::pi;

/// Directions all over the sphere.
std::vector<Vec3f> directions(int count) {
  std::vector<Vec3f> out;
  for (int i = 0; i < count; ++i) {
    const float up = 1.0f - 2.0f * (static_cast<float>(i) + 0.5f) / static_cast<float>(count);
    const float angle = 2.4f * static_cast<float>(i), flat = std::sqrt(1.0f - up * up);
    out.emplace_back(flat * std::cos(angle), up, flat * std::sin(angle));
  }
  return out;
}

Vec3f turned(const Vec3f& v, double degrees) {
  const double a = degrees * pi / 180.0;
  return Vec3f(
      Vec3(v.x * std::cos(a) + v.z * std::sin(a), v.y, v.z * std::cos(a) - v.x * std::sin(a)));
}

class EnvironmentFileTest : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& bytes) const {
    return test::write_bytes(folder_.file(name), bytes);
  }
  /// What load_environment() says of \p bytes.
  std::string said(const std::string& bytes) const {
    return test::refusal_of([&] { load_environment(write("broken.hdr", bytes), 0.0); });
  }
  const test::Folder folder_;
};

TEST_F(EnvironmentFileTest, HdrFilesAreReadPackedAndPlain) {
  const RadiancePicture picture = outdoors(64);
  for (const bool packed : {false, true}) {
    const RadiancePicture read = load_radiance(write("a.hdr", hdr_bytes(picture, packed)));
    ASSERT_EQ(read.width, 128);
    ASSERT_EQ(read.pixels.size(), picture.pixels.size());
    for (std::size_t i = 0; i < read.pixels.size(); ++i) {
      const Vec3f& p = picture.pixels[i];
      const float step = std::max({p.x, p.y, p.z}) / 128.0f;  // of eight bits
      EXPECT_LE(glm::length(read.pixels[i] - p), 2.0f * step) << i;
    }
  }
}

// Radiance's programs multiply pixels and note by how much: divided by it they are radiances again.
TEST_F(EnvironmentFileTest, ExposuresAreTakenBack) {
  const RadiancePicture picture = outdoors(16);
  std::string bytes = hdr_bytes(picture);
  const std::vector<Vec3f> plain = load_radiance(write("a.hdr", bytes)).pixels;
  bytes.insert(bytes.find('\n') + 1, "EXPOSURE=4\nEXPOSURE= 5e-1\n");
  const std::vector<Vec3f> brighter = load_radiance(write("b.hdr", bytes)).pixels;
  for (std::size_t i = 0; i < plain.size(); ++i) EXPECT_EQ(2.0f * brighter[i], plain[i]) << i;
}

TEST_F(EnvironmentFileTest, PngFilesAreLinear) {
  Picture grey{2, 1, 3, {255, 255, 255, 188, 188, 188}};
  const std::vector<std::uint8_t> bytes = encode_png(grey);
  const RadiancePicture read = load_radiance(write("a.png", {bytes.begin(), bytes.end()}));
  ASSERT_EQ(read.pixels.size(), 2u);
  EXPECT_FLOAT_EQ(read.pixels[0].x, 1.0f);
  EXPECT_NEAR(read.pixels[1].y, 0.503f, 0.001f);
}

TEST_F(EnvironmentFileTest, WhatIsBrokenIsSaid) {
  const std::string whole = hdr_bytes(outdoors(16));
  const auto has = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos ? ::testing::AssertionSuccess()
                                                : ::testing::AssertionFailure() << text;
  };
  EXPECT_EQ(said(whole), "");
  for (std::size_t length = 2; length < whole.size(); ++length)
    ASSERT_TRUE(has(said(whole.substr(0, length)),
                    length < whole.find("+X 32\n") + 6 ? "readable" : "cut off"))
        << length;
  EXPECT_TRUE(has(said("half of it"), "no .hdr file"));
  EXPECT_TRUE(has(said("\x76\x2f\x31\x01\x02"), "OpenEXR"));
  EXPECT_TRUE(has(said("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 2\n"), "rle_xyze"));
  EXPECT_TRUE(has(said("#?RADIANCE\n\n+Y 1 +X 2\n"), "-Y HEIGHT +X WIDTH"));
  EXPECT_TRUE(has(said("#?RADIANCE\n\n-Y 100000 +X 200000\n"), "at most"));
  EXPECT_TRUE(has(said("#?RADIANCE\n\n-Y 0 +X 0\n"), "at least"));
  for (const char* exposure : {"0", "-1", "nan", "1e99", "", "bright"})
    EXPECT_TRUE(has(said(fmt::format("#?RADIANCE\nEXPOSURE={}\n\n-Y 1 +X 2\n", exposure)),
                    "where a finite number above 0"))
        << exposure;
  std::string old_run = "#?RADIANCE\n\n-Y 8 +X 16\n";
  old_run += {9, 9, 9, 127, 1, 1, 1, 15};
  EXPECT_TRUE(has(said(old_run), "row 1 has runs of pixels"));
  std::string long_run = "#?RADIANCE\n\n-Y 8 +X 16\n";
  long_run += {2, 2, 0, 16, static_cast<char>(128 + 17), 7};
  EXPECT_TRUE(has(said(long_run), "holds more than its 16"));
  EXPECT_TRUE(has(said(hdr_bytes({16, 16, std::vector<Vec3f>(256)})), "twice as wide as high"));
  EXPECT_TRUE(has(said(hdr_bytes(even_environment(Vec3f(3e9f)))), "radiances from 0"));
  EXPECT_THROW(load_environment(folder_.file("missing.hdr"), 0.0), Error);
  RadiancePicture no_number = even_environment(Vec3f(1.0f));
  no_number.pixels[70].y = std::nanf("");
  EXPECT_THROW(Environment(no_number, 0.0, "it"), Error);
}

// A header alone asks for no memory: this one's picture would be of 1.6 GB, of which there is a quarter.
TEST_F(EnvironmentFileTest, HeadersAloneTakeNoMemory) {
  if (test::sanitized()) GTEST_SKIP() << "the sanitizers' own memory has no such limit";
  long pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  ASSERT_GT(pages, 0);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_AS, &before), 0);
  rlimit limit = before;
  limit.rlim_cur =
      static_cast<rlim_t>(pages) * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + (400 << 20);
  ASSERT_EQ(setrlimit(RLIMIT_AS, &limit), 0);
  EXPECT_NO_THROW({
    const std::string text = said("#?RADIANCE\n\n-Y 8192 +X 16384\n");
    EXPECT_NE(text.find("cut off in row 1 of 8192"), std::string::npos) << text;
  });
  ASSERT_EQ(setrlimit(RLIMIT_AS, &before), 0);
}

// An even light L gives a surface pi L, whichever way it faces. Cells of 64 rows that the horizon cuts count as
// above it or below: less than 2 pi (pi / 64)^2 / 8 of it.
TEST(EnvironmentTest, OneColourGivesPiTimesItself) {
  const Vec3f colour(2.0f, 1.0f, 0.25f);
  for (const int height : {1, 5, 64, 600}) {
    const Environment environment(even_environment(colour, height), 30.0, "even");
    for (const Vec3f& normal : directions(100)) {
      const Vec3f found = environment.irradiance(normal) / (static_cast<float>(pi) * colour);
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(found[k], 1.0f, 1e-3f) << height;
      EXPECT_NEAR(environment.radiance(normal).x, 2.0f, 1e-5f);
      EXPECT_NEAR(environment.radiance(normal, 0.1f).x, 2.0f, 1e-5f);
    }
  }
}

TEST(EnvironmentTest, BlackIsDark) {
  const Environment environment(even_environment(Vec3f(0.0f)), 0.0, "black");
  EXPECT_EQ(environment.sample({0.3f, 0.7f}).density, 0.0f);
  EXPECT_EQ(environment.irradiance({0, 1, 0}), Vec3f(0.0f));
  EXPECT_TRUE(environment.parts(16).empty());
}

// The picture's middle is at +x, what is right of it at +z, its upper edge up.
TEST(EnvironmentTest, DirectionsAreThoseOfThePicture) {
  RadiancePicture picture = even_environment(Vec3f(0.0f), 32);
  picture.pixels[16 * 64 + 31] = picture.pixels[16 * 64 + 32] = Vec3f(1, 0, 0);
  picture.pixels[15 * 64 + 31] = picture.pixels[15 * 64 + 32] = Vec3f(1, 0, 0);
  for (const int y : {15, 16})
    for (const int x : {47, 48})
      picture.pixels[static_cast<std::size_t>(y * 64 + x)] = Vec3f(0, 1, 0);
  for (std::size_t x = 0; x < 64; ++x) picture.pixels[x] = Vec3f(0, 0, 1);
  const Environment environment(picture, 0.0, "it");
  EXPECT_NEAR(environment.radiance({2, 0, 0}).x, 1.0f, 1e-4f);
  EXPECT_NEAR(environment.radiance({0, 0, 3}).y, 1.0f, 1e-4f);
  EXPECT_NEAR(environment.radiance({0, 1, 0}).z, 1.0f, 1e-4f);
  // A turn by 90 degrees, seen from above counter-clockwise, brings +x to -z.
  const Environment quarter(picture, 90.0, "it");
  EXPECT_NEAR(quarter.radiance({0, 0, -1}).x, 1.0f, 1e-4f);
}

// Turned by its columns the picture is the same to rounding, and so is all that follows from it.
TEST(EnvironmentTest, ATurnTurnsAll) {
  const RadiancePicture picture = outdoors(64);
  const Environment straight(picture, 0.0, "it"), round(picture, -135.0, "it");
  for (const Vec3f& way : directions(200)) {
    const Vec3f there = turned(way, -135.0);
    EXPECT_NEAR(glm::length(straight.radiance(way) - round.radiance(there)), 0.0f,
                2e-2f * (1.0f + glm::length(straight.radiance(way))));
    EXPECT_NEAR(glm::length(straight.irradiance(way) - round.irradiance(there)), 0.0f, 0.1f);
  }
  const auto parts = straight.parts(8), others = round.parts(8);
  ASSERT_EQ(parts.size(), others.size());
  for (std::size_t i = 0; i < parts.size(); ++i)
    EXPECT_NEAR(glm::length(turned(parts[i].direction, -135.0) - others[i].direction), 0.0f, 1e-4f);
  for (int i = 0; i < 16; ++i) {
    const Vec2f square = sample_point(static_cast<std::uint32_t>(i), 5u);
    EXPECT_NEAR(glm::length(turned(straight.sample(square).direction, -135.0) -
                            round.sample(square).direction),
                0.0f, 1e-4f);
  }
}

// What importance sampling finds is what uniform sampling of the pixels does.
TEST(EnvironmentTest, SamplesAreUnbiased) {
  const RadiancePicture picture = outdoors(64);
  const Environment environment(picture, 0.0, "it");
  for (const Vec3f& normal : directions(12)) {
    Vec3 exact(0.0), found(0.0);
    constexpr int fine = 4;  // parts of a pixel
    for (int y = 0; y < 64 * fine; ++y) {
      const double top = std::cos(pi * y / (64.0 * fine)),
                   bottom = std::cos(pi * (y + 1) / (64.0 * fine));
      const double up = 0.5 * (top + bottom), flat = std::sqrt(1.0 - up * up);
      for (int x = 0; x < 128 * fine; ++x) {
        const double angle = 2.0 * pi * ((x + 0.5) / (128.0 * fine) - 0.5);
        const double cosine =
            glm::dot(Vec3(normal), Vec3(flat * std::cos(angle), up, flat * std::sin(angle)));
        exact += std::max(cosine, 0.0) * (top - bottom) * (2.0 * pi / (128.0 * fine)) *
                 Vec3(picture.pixels[static_cast<std::size_t>(y / fine * 128 + x / fine)]);
      }
    }
    constexpr std::uint32_t count = 4096;
    for (std::uint32_t i = 0; i < count; ++i) {
      const EnvironmentSample sample = environment.sample(sample_point(i, 7u));
      found += Vec3(sample.radiance) *
               static_cast<double>(std::max(glm::dot(normal, sample.direction), 0.0f) /
                                   sample.density / count);
    }
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(found[k], exact[k], 0.01 * exact[k]);
      EXPECT_NEAR(environment.irradiance(normal)[k], exact[k], 0.005 * (exact[k] + 1.0));
    }
  }
}

// The parts that are not sharp, cut further, give what they gave.
TEST(EnvironmentTest, FinerPartsGiveTheSame) {
  const Environment environment(outdoors(64), 0.0, "it");
  Vec3 coarse(0.0), fine(0.0);
  std::size_t sharp = 0;
  for (const EnvironmentPart& part : environment.parts(16))
    if (part.is_sharp())
      ++sharp;
    else
      coarse += Vec3(part.irradiance.y * part.direction);
  EXPECT_EQ(sharp, 1u) << "the sun";
  const auto parts = environment.soft_parts(16, 512);
  EXPECT_EQ(parts.size(), 512u);
  for (const EnvironmentPart& part : parts) fine += Vec3(part.irradiance.y * part.direction);
  EXPECT_LT(glm::length(fine - coarse), 1e-3 * glm::length(coarse));
}

// The parts together give a floor, or whatever sees all of them, what the picture does; the sun is one of them.
TEST(EnvironmentTest, PartsGiveWhatThePictureDoes) {
  const Environment environment(outdoors(64), 0.0, "it");
  for (const std::size_t count : {1u, 4u, 16u, 64u}) {
    const auto parts = environment.parts(count);
    EXPECT_EQ(parts.size(), std::max<std::size_t>(count, 3));
    Vec3f all(0.0f);  // the vector irradiance of green
    int suns = 0;
    for (const EnvironmentPart& part : parts) {
      all += part.irradiance.y * part.direction;
      suns += part.width.x < 0.06f && part.width.y < 0.06f && part.irradiance.y > 3.0f;
    }
    const Vec3f expected = {
        environment.irradiance({1, 0, 0}).y - environment.irradiance({-1, 0, 0}).y,
        environment.irradiance({0, 1, 0}).y - environment.irradiance({0, -1, 0}).y,
        environment.irradiance({0, 0, 1}).y - environment.irradiance({0, 0, -1}).y};
    if (count >= 16) {
      EXPECT_LT(glm::length(all - expected), 0.03f * glm::length(expected)) << count;
    }
    if (count >= 16) {
      EXPECT_EQ(suns, 1) << count;
    }
  }
}

}  // namespace
}  // namespace polyhull
