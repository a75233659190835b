// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/cameras/camera_picture.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numbers>
#include <thread>

#include "base/error.h"
#include "base/thread_pool.h"
#include "builtin/default_rig.h"
#include "support/folder.h"

namespace polyhull {
namespace {

/// A finely tessellated sphere of radius \p radius around the origin as an OBJ file.
std::string sphere_file(double radius) {
  const std::string path =
      (std::filesystem::temp_directory_path() / "polyhull_sphere_test.obj").string();
  std::ofstream file(path);
  file.precision(9);
  constexpr int rings = 160, sectors = 320;
  file << "v 0 " << radius << " 0\n";
  for (int i = 1; i < rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      const double a = std::numbers::pi * i / rings, b = 2.0 * std::numbers::pi * j / sectors;
      file << "v " << radius * std::sin(a) * std::sin(b) << ' ' << radius * std::cos(a) << ' '
           << radius * std::sin(a) * std::cos(b) << '\n';
    }
  }
  file << "v 0 " << -radius << " 0\n";
  const int last = 2 + (rings - 1) * sectors;
  const auto at = [&](int i, int j) { return 2 + (i - 1) * sectors + j % sectors; };
  for (int j = 0; j < sectors; ++j) {
    file << "f 1 " << at(1, j) << ' ' << at(1, j + 1) << '\n';
    file << "f " << last << ' ' << at(rings - 1, j + 1) << ' ' << at(rings - 1, j) << '\n';
    for (int i = 1; i + 1 < rings; ++i) {
      file << "f " << at(i, j) << ' ' << at(i + 1, j) << ' ' << at(i + 1, j + 1) << ' '
           << at(i, j + 1) << '\n';
    }
  }
  return path;
}

/// Does the ray through the real pixel (x, y) meet the sphere; z_cam of the first hit, else 0.
double sphere_depth(const Camera& camera, const Vec3& centre, double radius, double x, double y) {
  const Vec3 ray = camera.ray(camera.undistort({x, y}));  // z_cam = 1
  const Vec3 o = camera.centre() - centre;
  const double a = glm::dot(ray, ray), b = glm::dot(o, ray), c = glm::dot(o, o) - radius * radius;
  const double d = b * b - a * c;
  return d < 0.0 ? 0.0 : (-b - std::sqrt(d)) / a;
}

class SphereMatte : public testing::TestWithParam<bool> {};

TEST_P(SphereMatte, MatchesTheAnalyticOne) {
  constexpr double radius = 0.5;
  Rig rig = default_rig();
  for (Camera& camera : rig.cameras) {
    if (GetParam()) camera.distortion = {-0.28, 0.11, 0.0012, -0.0009, -0.02};
  }
  const auto sphere = open_subject(sphere_file(radius));
  ASSERT_EQ(sphere->warning(), "");
  const Camera& camera = rig.cameras[1];
  CameraPicture picture(rig, 1, sphere);
  picture.set_time(0.7);
  std::vector<std::uint8_t> matte(1024 * 768);
  std::vector<float> depth(1024 * 768);
  picture.matte(matte.data(), 1024);
  picture.depth(depth.data());
  const Vec3 centre(0, radius, 0);
  constexpr int fine = 16;
  double squares = 0.0, edges = 0.0, area = 0.0, true_area = 0.0, worst = 0.0, worst_depth = 0.0;
  const Rectangle region = picture.region();
  for (int y = region.y - 2; y < region.y + region.height + 2; ++y) {
    for (int x = region.x - 2; x < region.x + region.width + 2; ++x) {
      int hits = 0;
      const int value = matte[y * 1024 + x];
      const bool in = sphere_depth(camera, centre, radius, x, y) > 0.0;
      const bool edge = (sphere_depth(camera, centre, radius, x - 0.8, y - 0.8) > 0.0) != in ||
                        (sphere_depth(camera, centre, radius, x + 0.8, y + 0.8) > 0.0) != in ||
                        (sphere_depth(camera, centre, radius, x - 0.8, y + 0.8) > 0.0) != in ||
                        (sphere_depth(camera, centre, radius, x + 0.8, y - 0.8) > 0.0) != in;
      double expected = in;
      if (edge) {
        for (int j = 0; j < fine; ++j) {
          for (int i = 0; i < fine; ++i) {
            hits += sphere_depth(camera, centre, radius, x + (i + (j + 0.5) / fine) / fine - 0.5,
                                 y + (j + (i + 0.5) / fine) / fine - 0.5) > 0.0;
          }
        }
        expected = hits / static_cast<double>(fine * fine);
      }
      const double error = value / 255.0 - expected;
      worst = std::max(worst, std::abs(error));
      squares += error * error;
      edges += edge;
      area += value / 255.0;
      true_area += expected;
      const double truth = sphere_depth(camera, centre, radius, x, y);
      if (truth > 0.0 && !edge)
        worst_depth = std::max(worst_depth, std::abs(depth[y * 1024 + x] - truth));
    }
  }
  CameraPicture exact(rig, 1, sphere, PictureQuality::exact);
  exact.set_time(0.7);
  std::vector<std::uint8_t> exact_matte(matte.size());
  exact.matte(exact_matte.data(), 1024);
  EXPECT_EQ(matte, exact_matte);
  const double perimeter = 2.0 * std::sqrt(std::numbers::pi * true_area);
  RecordProperty("bias_px_millionths", static_cast<int>(1e6 * (area - true_area) / perimeter));
  // The polyhedron lies up to r (1 - cos(pi / 320)) = 0.02 mm inside the sphere, about 0.006 px.
  EXPECT_LT(std::abs(area - true_area) / perimeter, 0.012)
      << "mean displacement of the outline in px";
  // Edges along the sample lattice can be off by half of one of its lines of eight.
  EXPECT_LT(worst, 0.07);
  EXPECT_LT(std::sqrt(squares / edges), 0.02);
  EXPECT_LT(worst_depth, 0.004);
}
INSTANTIATE_TEST_SUITE_P(Lens, SphereMatte, testing::Bool());

/// Share of points of the surface, projected into a camera, that fall onto its matte, and the share
/// of the matte's pixels that have such a point near: the same instant in all cameras.
TEST(CameraPicture, AllCamerasSeeTheSameInstant) {
  const Rig rig = default_rig();
  const auto figure = open_subject("figure");
  for (const double time : {0.0, 2.3, 7.1}) {
    SubjectFrame frame;
    figure->pose(time, frame);
    for (int c = 0; c < 4; ++c) {
      CameraPicture picture(rig, c, figure);
      picture.set_time(time);
      std::vector<std::uint8_t> matte(1024 * 768), points(1024 * 768, 0);
      picture.matte(matte.data(), 1024);
      for (std::size_t t = 0; t < figure->triangles().size(); t += 3) {
        for (int k = 0; k < 7; ++k) {
          const Vec3 weights[7] = {{1, 0, 0},   {0, 1, 0},   {0, 0, 1},      {.5, .5, 0},
                                   {0, .5, .5}, {.5, 0, .5}, {.34, .33, .33}};
          Vec3 p(0.0);
          for (int i = 0; i < 3; ++i)
            p += weights[k][i] * Vec3(frame.positions[figure->triangles()[t + i]]);
          const auto pixel = rig.cameras[c].project(p);
          ASSERT_TRUE(pixel);
          points[std::lround(pixel->y) * 1024 + std::lround(pixel->x)] = 1;
        }
      }
      std::size_t both = 0, either = 0;
      for (std::size_t i = 0; i < matte.size(); ++i) {
        both += points[i] && matte[i] >= 16;
        either += points[i] || matte[i] >= 16;
      }
      EXPECT_GT(static_cast<double>(both) / either, 0.97) << "camera " << c << " at " << time;
    }
  }
}

TEST(CameraPicture, ArmsOnHipsLeaveHoles) {
  // At 6.9 s a ray between arm and body goes through: the matte has background enclosed by
  // foreground.
  const Rig rig = default_rig();
  CameraPicture picture(rig, 0, open_subject("figure"));
  picture.set_time(6.9);
  std::vector<std::uint8_t> matte(1024 * 768);
  picture.matte(matte.data(), 1024);
  std::vector<int> stack = {0};
  std::vector<bool> outside(matte.size(), false);
  outside[0] = true;
  while (!stack.empty()) {
    const int i = stack.back();
    stack.pop_back();
    const int x = i % 1024, y = i / 1024;
    for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      if (x + dx < 0 || x + dx > 1023 || y + dy < 0 || y + dy > 767) continue;
      const int n = i + dx + 1024 * dy;
      if (!outside[n] && matte[n] == 0) {
        outside[n] = true;
        stack.push_back(n);
      }
    }
  }
  int enclosed = 0;
  for (std::size_t i = 0; i < matte.size(); ++i) enclosed += matte[i] == 0 && !outside[i];
  EXPECT_GT(enclosed, 100);
}

/// The picture of a cube of few large triangles, coloured by position, does not show where they
/// were split.
TEST(CameraPicture, LargeTrianglesKeepTheirColours) {
  const test::Folder folder;
  const std::string path = folder.file("wall.obj");
  std::ofstream(path)
      << "v -1 0 0 0 0 0\nv 1 0 0 1 0 0\nv 1 2 0 1 1 0\nv -1 2 0 0 1 0\nf 1 2 3\nf 1 3 4\n";
  Rig rig = default_rig();
  Camera& camera = rig.cameras[0];
  camera.R = Mat3(Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(0, 0, -1));
  camera.t = Vec3(0, 1, 3);  // from +z
  for (const bool lens : {false, true}) {
    camera.distortion = lens ? std::vector<double>{-0.2, 0.05, 0.0, 0.0} : std::vector<double>{};
    CameraPicture picture(rig, 0, open_subject(path));
    picture.set_time(0.0);
    std::vector<std::uint8_t> pixels(1024 * 768 * 4);
    picture.picture({}, 0, true, pixels.data(), 4096);
    const float light = studio_light({0, 0, 1});
    int seen = 0;
    for (int y = 0; y < 768; y += 7) {
      for (int x = 0; x < 1024; x += 7) {
        const std::uint8_t* p = &pixels[(y * 1024 + x) * 4];
        if (p[3] != 255) continue;
        ++seen;
        const Vec2 ideal = camera.undistort(Vec2(x, y));
        const double u = (ideal.x - 511.5) * 3.0 / 700.0, v = (383.5 - ideal.y) * 3.0 / 700.0;
        ASSERT_NEAR(p[0], 255.0 * srgb_from_linear(light * static_cast<float>(0.5 * (u + 1.0))),
                    1.5);
        ASSERT_NEAR(p[1], 255.0 * srgb_from_linear(light * static_cast<float>(0.5 * (v + 1.0))),
                    1.5);
      }
    }
    EXPECT_GT(seen, 2000);
  }
}

PictureLook studio() {
  PictureLook look;
  look.screen = {{40, 170, 60}, 0.1};
  look.shadow = 0.3;
  look.spill = 0.1;
  look.noise = 2.0;
  look.seed = 5;
  return look;
}

TEST(CameraPicture, SameBytesOnOneThreadAndMany) {
  Rig rig = default_rig();
  rig.cameras[2].distortion = {-0.1, 0.02, 0.0, 0.0};
  for (const PictureQuality quality : {PictureQuality::fast, PictureQuality::exact}) {
    std::vector<std::uint8_t> pictures[3];
    for (int run = 0; run < 3; ++run) {
      set_pool_threads(run == 1 ? 4 : 1);
      CameraPicture picture(rig, 2, open_subject("figure"), quality);
      picture.set_time(4.4);
      pictures[run].resize(1024 * 768 * 4);
      picture.picture(studio(), 17, false, pictures[run].data(), 4096);
    }
    set_pool_threads(0);
    EXPECT_EQ(pictures[0], pictures[1]);
    EXPECT_EQ(pictures[0], pictures[2]);
  }
}

/// What both qualities make of an instant.
struct Drawn {
  std::vector<std::uint8_t> pixels, matte;
  std::vector<float> depth;
};

Drawn drawn(CameraPicture picture, double time) {
  const Camera& camera = picture.camera();
  const std::size_t count = static_cast<std::size_t>(camera.width) * camera.height;
  Drawn result{std::vector<std::uint8_t>(4 * count), std::vector<std::uint8_t>(count),
               std::vector<float>(count)};
  PictureLook look = studio();
  look.noise = 0.0;
  picture.set_time(time);
  picture.picture(look, 0, true, result.pixels.data(), 4 * camera.width);
  picture.matte(result.matte.data(), camera.width);
  picture.depth(result.depth.data());
  return result;
}

/// Mean and root mean square of \p a - \p b over the colours where either shows the subject.
std::pair<double, double> colour_difference(const Drawn& a, const Drawn& b) {
  double sum = 0.0, squares = 0.0, count = 0.0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    if (i % 4 == 3 || (a.matte[i / 4] == 0 && b.matte[i / 4] == 0)) continue;
    const double d = static_cast<double>(a.pixels[i]) - b.pixels[i];
    sum += d;
    squares += d * d;
    ++count;
  }
  return {sum / count, std::sqrt(squares / count)};
}

/// Of one surface everything but the colours inside outlines is the same in both qualities.
TEST(CameraPicture, OutlinesAloneNeedSamples) {
  Rig rig = default_rig();
  rig.cameras[1].distortion = {-0.28, 0.11, 0.0012, -0.0009, -0.02};
  for (const char* name : {"figure", "hairy"}) {
    const auto subject = open_subject(name);
    for (const double time : {0.0, 3.3, 6.9}) {
      for (const int camera : {0, 1, 3}) {
        CameraPicture fast(rig, camera, subject);
        const std::shared_ptr<const Subject> same(subject, &fast.subject());
        const Drawn exact = drawn(CameraPicture(rig, camera, same, PictureQuality::exact), time);
        const Drawn a = drawn(std::move(fast), time);
        ASSERT_EQ(a.matte, exact.matte) << name << " at " << time;
        ASSERT_EQ(a.depth, exact.depth) << name << " at " << time;
        for (std::size_t i = 0; i < a.pixels.size(); ++i)
          ASSERT_TRUE(a.pixels[i] == exact.pixels[i] || (i % 4 != 3 && a.matte[i / 4] != 0));
        const auto [mean, rms] = colour_difference(a, exact);
        RecordProperty("mean_thousandths", static_cast<int>(1000.0 * mean));
        RecordProperty("rms_thousandths", static_cast<int>(1000.0 * rms));
        EXPECT_LT(std::abs(mean), 0.1) << name << " at " << time;
        EXPECT_LT(rms, 1.5) << name << " at " << time;
      }
    }
  }
}

/// default_rig() with pixels \p times as large.
Rig rig_with_pixels(double times) {
  Rig rig = default_rig();
  for (Camera& camera : rig.cameras) {
    camera.width = static_cast<int>(camera.width / times);
    camera.height = static_cast<int>(camera.height / times);
    for (int column = 0; column < 3; ++column)
      for (int row = 0; row < 2; ++row) camera.K[column][row] /= times;
  }
  return rig;
}

/// The coarser surfaces of the quality fast show the same person.
TEST(CameraPicture, FastIsNearExact) {
  const auto subject = open_subject("figure");
  for (const double pixels : {0.5, 1.0, 2.0}) {
    const Rig rig = rig_with_pixels(pixels);
    for (const double time : {0.0, 3.3, 6.9}) {
      for (const int camera : {0, 1, 3}) {
        const Drawn fast = drawn(CameraPicture(rig, camera, subject), time);
        const Drawn exact = drawn(CameraPicture(rig, camera, subject, PictureQuality::exact), time);
        // The difference of the areas by the outline's length is how far it lies outside.
        const int width = rig.cameras[camera].width;
        double area = 0.0, apart = 0.0, squares = 0.0, length = 0.0;
        for (std::size_t i = width + 1; i < exact.matte.size(); ++i) {
          const double d = (static_cast<double>(fast.matte[i]) - exact.matte[i]) / 255.0;
          area += d;
          apart += std::abs(d);
          squares += d * d;
          length += std::hypot(exact.matte[i] - exact.matte[i - 1],
                               exact.matte[i] - exact.matte[i - width]) /
                    255.0;
        }
        const auto [mean, rms] = colour_difference(fast, exact);
        EXPECT_LT(std::abs(area / length), 0.02) << pixels << ", " << camera << ", " << time;
        EXPECT_LT(apart / length, 0.08) << pixels << ", " << camera << ", " << time;
        EXPECT_LT(std::sqrt(squares / length), 0.12) << pixels << ", " << camera << ", " << time;
        EXPECT_LT(std::abs(mean), 0.5) << pixels << ", " << camera << ", " << time;
        EXPECT_LT(rms, 5.0) << pixels << ", " << camera << ", " << time;
      }
    }
  }
}

TEST(CameraPicture, LargePixelsGetACoarseSurface) {
  const auto subject = open_subject("figure");
  const std::size_t all = subject->triangles().size() / 3;
  std::size_t before = all + 1;
  for (const double pixels : {0.25, 0.5, 1.0, 2.0}) {
    Rig rig = rig_with_pixels(pixels);
    CameraPicture picture(rig, 0, subject);
    const std::size_t drawn_triangles = picture.subject().triangles().size() / 3;
    EXPECT_LT(drawn_triangles, before);
    if (pixels < 0.5) {
      EXPECT_EQ(drawn_triangles, all);
    }
    before = drawn_triangles;
    EXPECT_EQ(&CameraPicture(rig, 0, subject, PictureQuality::exact).subject(), subject.get());
    // Cameras share what they draw.
    EXPECT_EQ(&CameraPicture(rig, 2, subject).subject(), &picture.subject());
    // The unit does not matter.
    rig.unit = "mm";
    for (Camera& camera : rig.cameras) camera.t *= 1000.0;
    rig.bounds.reset();
    EXPECT_EQ(&CameraPicture(rig, 0, subject).subject(), &picture.subject());
  }
  // Hair is not made coarser.
  const auto hairy = open_subject("hairy");
  EXPECT_EQ(&CameraPicture(rig_with_pixels(2.0), 0, hairy).subject(), hairy.get());
}

/// A triangle of its own for each instant, and how often it was asked for.
class CountedSubject : public Subject {
 public:
  CountedSubject() {
    triangles_ = {0, 1, 2, 2, 1, 0};
    vertex_count_ = 3;
  }
  void pose(double seconds, SubjectFrame& frame) const override {
    ++poses;
    frame.positions = {{0, 1, 0}, {0.5, 1, 0}, {0, 1.5f + 0.1f * static_cast<float>(seconds), 0}};
    frame.normals.assign(3, {0, 0, 1});
  }
  Vec3f albedo(std::uint32_t, const Vec3f&, float) const override { return Vec3f(0.5f); }
  mutable std::atomic<int> poses = 0;
};

TEST(CameraPicture, CamerasOfAnInstantShareThePose) {
  const Rig rig = default_rig();
  const auto subject = std::make_shared<CountedSubject>();
  std::vector<std::thread> cameras;
  for (int c = 0; c < 4; ++c) {
    cameras.emplace_back([&, c] {
      CameraPicture picture(rig, c, subject);
      std::vector<std::uint8_t> matte(1024 * 768);
      for (int n = 0; n < 6; ++n) {
        picture.set_time(0.04 * n);
        picture.matte(matte.data(), 1024);
        EXPECT_EQ(picture.surface().positions[2].y, 1.5f + 0.1f * static_cast<float>(0.04 * n));
      }
    });
  }
  for (std::thread& camera : cameras) camera.join();
  EXPECT_EQ(subject->poses, 6);
}

TEST(CameraPicture, EachKnobDoesWhatItSays) {
  const Rig rig = default_rig();
  CameraPicture picture(rig, 0, open_subject("figure"));
  picture.set_time(6.9);
  std::vector<std::uint8_t> clean(1024 * 768 * 4), other(clean.size()), matte(1024 * 768);
  PictureLook look;
  look.screen = {{40, 170, 60}, 0.0};
  picture.picture(look, 0, false, clean.data(), 4096);
  picture.matte(matte.data(), 1024);
  for (std::size_t i = 0; i < matte.size(); ++i) {
    ASSERT_EQ(clean[4 * i + 3], 255);
    if (matte[i] != 0) continue;
    ASSERT_EQ(clean[4 * i], 40);
    ASSERT_EQ(clean[4 * i + 1], 170);
    ASSERT_EQ(clean[4 * i + 2], 60);
  }
  const auto difference = [&](bool inside, double& mean, double& deviation) {
    double sum = 0.0, squares = 0.0, n = 0.0;
    for (std::size_t i = 0; i < matte.size(); ++i) {
      if (matte[i] != (inside ? 255 : 0)) continue;
      const double d = other[4 * i + 1] - clean[4 * i + 1];
      sum += d;
      squares += d * d;
      ++n;
    }
    mean = sum / n;
    deviation = std::sqrt(squares / n - mean * mean);
  };
  double mean = 0.0, deviation = 0.0;
  look.noise = 4.0;
  picture.picture(look, 0, false, other.data(), 4096);
  difference(false, mean, deviation);
  EXPECT_NEAR(mean, 0.0, 0.05);
  EXPECT_NEAR(deviation, std::sqrt(16.0 + 1.0 / 12.0), 0.05);
  const auto first = other;
  picture.picture(look, 1, false, other.data(), 4096);
  EXPECT_NE(first, other) << "each frame has noise of its own";
  look.noise = 0.0;
  look.spill = 0.5;
  picture.picture(look, 0, false, other.data(), 4096);
  difference(true, mean, deviation);
  EXPECT_GT(mean, 5.0);
  difference(false, mean, deviation);
  EXPECT_EQ(mean, 0.0);
  look.spill = 0.0;
  look.shadow = 0.5;
  picture.picture(look, 0, false, other.data(), 4096);
  difference(false, mean, deviation);
  EXPECT_LT(mean, -0.1);
  look.shadow = 0.0;
  look.screen.unevenness = 0.2;
  picture.picture(look, 0, false, other.data(), 4096);
  difference(false, mean, deviation);
  EXPECT_GT(deviation, 2.0);
  look.screen.unevenness = 0.0;
  picture.picture(look, 0, true, other.data(), 4096);
  for (std::size_t i = 0; i < matte.size(); ++i) ASSERT_EQ(other[4 * i + 3], matte[i]);
}

TEST(CameraPicture, OddViewsDoNoHarm) {
  // The camera inside the subject, behind it, beside it with half of it out of view, and
  // wide-angle.
  Rig rig = default_rig();
  const auto figure = open_subject("figure");
  const Vec3 places[] = {
      {0, 1.2, 0.0}, {0, 1.2, 0.36}, {0.3, 1.2, 0.5}, {0, 1.0, -8.0}, {0.0, 3.5, 0.01}};
  for (const Vec3& place : places) {
    for (const double k1 : {0.0, -0.4}) {
      Camera& camera = rig.cameras[0];
      camera.distortion = k1 != 0.0 ? std::vector<double>{k1, 0.05, 0, 0} : std::vector<double>{};
      camera.R = Mat3(1.0);
      camera.t = -place;
      CameraPicture picture(rig, 0, figure);
      picture.set_time(0.0);
      std::vector<std::uint8_t> matte(1024 * 768);
      picture.matte(matte.data(), 1024);
      const bool behind = place.z == -8.0;
      if (behind) {
        EXPECT_GT(picture.region().height, 50);
      }
    }
  }
}

}  // namespace
}  // namespace polyhull
