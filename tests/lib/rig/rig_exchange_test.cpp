// SPDX-License-Identifier: LGPL-2.1-or-later
// Rigs to other programs' files and back; Kalibr's and OpenTrackIO's own; files that are broken.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>

#include "base/error.h"
#include "rig/export.h"
#include "rig/file_names.h"
#include "rig/import.h"
#include "support/refusal.h"
#include "text_file.h"

namespace polyhull {
namespace {

namespace fs = std::filesystem;

// A folder of this name, empty.
std::string empty_folder(const std::string& name) {
  const fs::path path = fs::temp_directory_path() / "polyhull_rig_exchange" / name;
  fs::remove_all(path);
  fs::create_directories(path);
  return path.string();
}

// Names that no file, no column and no quotation mark may swallow.
const std::vector<std::string> odd_names{"cam 0", "../left/\"eye\"", ".hidden: #1 %41\t\x01",
                                         "köln's.2"};

// Cameras with numbers of full length, looking everywhere, each with \p lens coefficients.
Rig random_rig(unsigned seed, std::size_t lens) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Rig rig;
  for (const std::string& name : odd_names) {
    Camera& camera = rig.cameras.emplace_back();
    camera.name = name;
    camera.width = 1921;
    camera.height = 1077;
    camera.K = from_rows({1500 + 100 * unit(random), 0, 960 + 30 * unit(random), 0,
                          1500 + 100 * unit(random), 540 + 30 * unit(random), 0, 0, 1});
    for (std::size_t i = 0; i < lens; ++i) camera.distortion.push_back(0.05 * unit(random));
    camera.R = import::rotation_of(3.0 * Vec3(unit(random), unit(random), unit(random)));
    camera.t = Vec3(1e-7 * unit(random), 5 * unit(random), 3000 * unit(random));
  }
  return rig;
}

// No number differs by more than \p tolerance of itself (of 1, in a rotation).
void expect_same(const Rig& found, const Rig& wanted, double tolerance) {
  ASSERT_EQ(found.cameras.size(), wanted.cameras.size());
  for (const Camera& a : wanted.cameras) {
    const Camera* b = found.find(a.name);
    ASSERT_NE(b, nullptr) << a.name;
    EXPECT_EQ(a.width, b->width);
    EXPECT_EQ(a.height, b->height);
    EXPECT_EQ(a.distortion, b->distortion) << a.name;
    for (int i = 0; i < 3; ++i) {
      EXPECT_LE(std::abs(a.t[i] - b->t[i]), tolerance * std::abs(a.t[i])) << a.name;
      for (int j = 0; j < 3; ++j) {
        EXPECT_LE(std::abs(a.K[i][j] - b->K[i][j]), tolerance * std::abs(a.K[i][j])) << a.name;
        EXPECT_LE(std::abs(a.R[i][j] - b->R[i][j]), tolerance) << a.name;
      }
    }
  }
}

using test::expect_refused;

std::vector<std::string> files_in(const std::string& folder) {
  std::vector<std::string> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return files;
}

TEST(RigExchange, NamesOfFiles) {
  EXPECT_EQ(file_name_of("cam0"), "cam0");
  EXPECT_EQ(file_name_of("a/b c"), "a%2Fb%20c");
  EXPECT_EQ(file_name_of(".."), "%2E.");
  for (const std::string& name : odd_names) EXPECT_EQ(name_of_file(file_name_of(name)), name);
  // What other programs wrote stays as it is.
  for (const char* stem : {"100%", "%4", "%zz", "%41", "%2f", "a%2E"})
    EXPECT_EQ(name_of_file(stem), stem);
}

TEST(RigExchange, OpenCvToTheLastBit) {
  for (const std::size_t lens : {0, 4, 5, 8, 12}) {
    Rig rig = random_rig(1, lens);
    rig.cameras[0].K[1][0] = 0.1;        // skew
    rig.cameras[1].t.x = 12345678901.0;  // a whole number beyond an int
    const std::string folder = empty_folder("opencv");
    exported::opencv(rig, folder);
    expect_same(import::opencv(files_in(folder), {}), rig, 0.0);
  }
}

TEST(RigExchange, ColmapToItsRounding) {
  for (unsigned seed = 0; seed < 12; ++seed) {  // all four branches of the quaternion
    for (const std::size_t lens : {0, 4, 5, 8}) {
      const Rig rig = random_rig(seed, lens);
      const std::string folder = empty_folder("colmap");
      exported::colmap(rig, folder);
      expect_same(import::colmap(folder, {}), rig, 2e-15);
    }
  }
}

TEST(RigExchange, KalibrToTheLastBit) {
  for (const std::size_t lens : {0, 4}) {
    const Rig rig = random_rig(3, lens);
    const std::string text = exported::kalibr(rig);
    expect_same(import::parse_kalibr(text, "test"), rig, 0.0);
  }
}

// As Kalibr's own programs read it: from camera to camera, the first one being the world.
TEST(RigExchange, KalibrsChainSaysTheSame) {
  const Rig rig = random_rig(4, 4);
  std::string text = exported::kalibr(rig);
  for (std::size_t at; (at = text.find("T_cam_imu")) != text.npos;)
    text.replace(at, 9, "ignored__");
  const Rig chain = import::parse_kalibr(text, "test");
  const Camera& first = rig.cameras[0];
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const Vec3 world(1.0, 2.0, -3.0);
    const Vec3 in_camera = chain.cameras[i].to_camera(first.to_camera(world));
    EXPECT_LT(glm::length(in_camera - rig.cameras[i].to_camera(world)), 1e-11);
  }
}

TEST(RigExchange, WhatAFormatCannotSayIsRefused) {
  Rig skewed = random_rig(5, 4);
  skewed.cameras[2].K[1][0] = 0.1;
  const std::string folder = empty_folder("refused");
  expect_refused([&] { exported::colmap(skewed, folder); }, "skew (K12 is 0.1)");
  expect_refused([&] { exported::kalibr(skewed); }, "skew (K12 is 0.1), for which Kalibr");
  expect_refused([&] { exported::colmap(random_rig(5, 12), folder); }, "thin-prism");
  for (const std::size_t lens : {5, 8, 12})
    expect_refused([&] { exported::kalibr(random_rig(5, lens)); },
                   fmt::format("'cam 0' has a lens of {} coefficients", lens));
  EXPECT_TRUE(fs::is_empty(folder));
  // Coefficients of 0 are no lens beyond the others.
  Rig plain = random_rig(5, 4);
  for (Camera& camera : plain.cameras) camera.distortion.resize(12);
  EXPECT_NO_THROW(exported::colmap(plain, folder));
  EXPECT_NO_THROW(exported::kalibr(plain));
  expect_refused([&] { exported::opencv(plain, folder + "/cameras.txt"); },
                 "Cannot make the folder");
}

const char* const kalibr_file = R"(cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]
  distortion_model: radtan
  intrinsics: [458.6, 457.3, 367.2, 248.4]
  resolution: [752, 480]
  rostopic: /stereo/left/image_raw
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.11]
  - [0.0, 0.0, -1.0, 0.02]
  - [0.0, 1.0, 0.0, 0.03]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: []
  distortion_model: none
  intrinsics: [457.6, 456.1, 379.9, 255.2]
  resolution: [752, 480]
  rostopic: /cam1
)";

std::string with(const std::string& text, const std::string& from, const std::string& to) {
  std::string result = text;
  const std::size_t at = result.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? result : result.replace(at, from.size(), to);
}

TEST(RigExchange, KalibrsOwn) {
  const Rig rig = import::parse_kalibr(kalibr_file, "chain");
  ASSERT_EQ(rig.cameras.size(), 2u);
  EXPECT_EQ(rig.cameras[0].name, "stereo/left");
  EXPECT_EQ(rig.cameras[1].name, "cam1");
  EXPECT_EQ(rig.cameras[0].t, Vec3(0.0));
  EXPECT_EQ(rig.cameras[1].t, Vec3(-0.11, 0.02, 0.03));
  EXPECT_EQ(to_rows(rig.cameras[1].R)[5], -1.0);
  EXPECT_EQ(rig.cameras[0].distortion, (std::vector<double>{-0.28, 0.07, 0.0002, 0.00002}));
  const auto refuses = [](const std::string& from, const std::string& to, const std::string& part) {
    expect_refused([&] { import::parse_kalibr(with(kalibr_file, from, to), "chain"); }, part);
  };
  refuses("pinhole", "omni", "chain, line 1, cam0: the camera model omni");
  refuses("radtan", "equidistant", "the distortion model equidistant");
  refuses("T_cn_cnm1", "T_other", "cam1: T_cn_cnm1 is missing");
  refuses("[458.6, ", "[", "intrinsics must be a list of 4 numbers");
  refuses("458.6", "a", "intrinsics holds something that is not a number");
  refuses("458.6", ".inf", "intrinsics holds something that is not a number");
  refuses("[752, ", "[752.5, ", "whole numbers");
  refuses("0.0, 0.0, 0.0, 1.0", "0.0, 0.0, 0.0, 2.0", "last row");
  refuses("1.0, 0.0, 0.0, -0.11", "-1.0, 0.0, 0.0, -0.11", "reflection");
  refuses("cam0:", "cam7:", "cam2 is missing between cam1 and cam7");
  refuses("[1]", "[1", "line ");
}

const char* const opentrackio_file = R"({
  "static": {"camera": {"label": "A", "activeSensorPhysicalDimensions": {"width": 36.0, "height": 20.25},
                        "activeSensorResolution": {"width": 3840, "height": 2160},
                        "anamorphicSqueeze": {"num": 1, "denom": 1}}},
  "lens": {"pinholeFocalLength": 24.3, "entrancePupilOffset": 0.12,
           "projectionOffset": {"x": 0.1, "y": -0.2}, "distortionOffset": {"x": 0.0, "y": 0.0},
           "distortion": [{"radial": [9.0]},
                          {"model": "Brown-Conrady U-D", "tangential": [2e-5, -3e-5],
                           "radial": [-1e-4, 2e-5, 3e-8, -1e-8, 2e-11, 1e-11]}]},
  "transforms": [
    {"id": "Dolly", "translation": {"x": 1, "y": 2, "z": 3}, "rotation": {"pan": 90, "tilt": 0, "roll": 0}},
    {"id": "Camera", "translation": {"x": 0.5, "y": 0, "z": 0}, "rotation": {"pan": 0, "tilt": -30, "roll": 0}}]
})";

TEST(RigExchange, OpenTrackIoByItsOwnFormulas) {
  const Camera camera = import::parse_opentrackio(opentrackio_file, "sample", {});
  EXPECT_EQ(camera.name, "A");
  // Pan 90 turns forward (y) to -x and right to y; the camera looks 30 degrees down.
  const double c = std::cos(std::acos(-1.0) / 6.0);
  const Vec3 forward(-c, 0.0, -0.5), right(0.0, 1.0, 0.0), up(-0.5, 0.0, c);
  const Vec3 pupil = Vec3(1.0, 2.5, 3.0) + 0.12 * forward;
  EXPECT_LT(glm::length(camera.centre() - pupil), 1e-12);
  for (const Vec2 p : {Vec2(0.0, 0.0), Vec2(5.0, -4.0), Vec2(-12.0, 7.0)}) {  // mm, y down
    const Vec3 world = pupil + 3.0 * (24.3 * forward + p.x * right - p.y * up);
    const double s = p.x * p.x + p.y * p.y;
    const double radial = (1.0 - 1e-4 * s + 3e-8 * s * s + 2e-11 * s * s * s) /
                          (1.0 + 2e-5 * s - 1e-8 * s * s + 1e-11 * s * s * s);
    const Vec2 distorted(p.x * radial + 2 * 2e-5 * p.x * p.y - 3e-5 * (s + 2 * p.x * p.x),
                         p.y * radial + 2e-5 * (s + 2 * p.y * p.y) - 2 * 3e-5 * p.x * p.y);
    const Vec2 pixel((distorted.x + 0.1) / 36.0 * 3840 + 1919.5,
                     (distorted.y - 0.2) / 20.25 * 2160 + 1079.5);
    const std::optional<Vec2> found = camera.project(world);
    ASSERT_TRUE(found);
    EXPECT_LT(glm::length(*found - pixel), 1e-9);
  }
}

TEST(RigExchange, OpenTrackIoRefusesWhatItCannotSay) {
  const auto refuses = [](const std::string& from, const std::string& to, const std::string& part) {
    expect_refused(
        [&] { import::parse_opentrackio(with(opentrackio_file, from, to), "sample", {}); }, part);
  };
  // 9 per square millimetre is no lens's.
  refuses("{\"model\": \"Brown-Conrady U-D\"", "{\"model\": \"Fisheye\"", "D-U");
  refuses("[{\"radial\": [9.0]},\n                          {\"model\": \"Brown-Conrady U-D\"",
          "[{\"model\": \"Fisheye\"", "has no model \"Brown-Conrady U-D\"");
  refuses(
      "\"distortionOffset\": {\"x\": 0.0", "\"distortionOffset\": {\"x\": 0.1",
      "distortionOffset is not 0; OpenCV's lenses are centred on the principal point. Calibrate");
  refuses("\"num\": 1", "\"num\": 2", "anamorphicSqueeze");
  refuses("24.3", "0", "/lens/pinholeFocalLength must be above 0");
  refuses("24.3", "\"24.3\"", "/lens/pinholeFocalLength must be a number");
  refuses("24.3", "1e999", "sample: ");
  refuses("\"pinholeFocalLength\": 24.3, ", "", "lacks lens.pinholeFocalLength");
  refuses("\"activeSensorResolution\": {\"width\": 3840, \"height\": 2160}", "\"label2\": 1",
          "--size WIDTHxHEIGHT");
  const std::string rest =
      "static.camera.activeSensorPhysicalDimensions (width and height of the sensor, mm); "
      "lens.pinholeFocalLength (mm)";
  expect_refused(
      [] { import::parse_opentrackio("{}", "sample", {}); },
      "the sample lacks static.camera.activeSensorResolution (give the pictures' size as "
      "--size WIDTHxHEIGHT); " +
          rest);
  import::Options sized;
  sized.width = 3840;
  sized.height = 2160;
  expect_refused([&] { import::parse_opentrackio("{}", "sample", sized); },
                 "the sample lacks " + rest);
  refuses("\"height\": 2160", "\"depth\": 2160", "lacks static.camera.activeSensorResolution");
  refuses("\"activeSensorPhysicalDimensions\"", "\"sensor\"",
          "lacks static.camera.activeSensorPhysicalDimensions");
  refuses("3840", "3840.5", "whole number");
  refuses("-1e-4,", "[],", "radial must be a number");
  refuses("1e-11]", "1e-11, 0]", "at most 6");
  refuses("{\"x\": 1,", "{", "translation.x must be a number");
  refuses("\"id\": \"Dolly\"", "\"scale\": {\"x\": 0, \"y\": 1, \"z\": 1}",
          "scale must be above 0");
  refuses("{", "[", "not JSON");
  refuses("\"num\": 1", "\"num\": " + std::string(1000000, '[') + std::string(1000000, ']'),
          "sample: more than 64 brackets");
}

TEST(RigExchange, OpenTrackIoNamesAndWorld) {
  const std::string folder = empty_folder("opentrackio");
  write_text(opentrackio_file, folder + "/one.json");
  write_text(with(opentrackio_file, "\"A\"", "\"B\""), folder + "/two.json");
  const Rig rig = import::opentrackio(files_in(folder), {});
  EXPECT_EQ(rig.up, Vec3(0.0, 0.0, 1.0));
  EXPECT_NE(rig.find("A"), nullptr);
  EXPECT_NE(rig.find("B"), nullptr);
  write_text(opentrackio_file, folder + "/two.json");
  EXPECT_NE(import::opentrackio(files_in(folder), {}).find("two"), nullptr);
}

// The 2005 prototype's world and camera axes as its Matlab lines make them.
TEST(RigExchange, BouguetsBoardInThePrototypesAxes) {
  const Camera camera = random_rig(6, 0).cameras[0];
  const std::string file = empty_folder("bouguet") + "/Calib_Results.m";
  const auto r = to_rows(camera.R);
  write_text(
      fmt::format(
          "fc = [ 700 ; 700 ];\ncc = [ 320 ; 240 ];\nnx = 640;\nny = 480;\n"
          "Rc_ext = [ {}, {}, {} ; {}, {}, {} ; {}, {}, {} ];\nTc_ext = [ {} ; {} ; {} ];\n",
          r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8], camera.t.x, camera.t.y, camera.t.z),
      file);
  import::Options options;
  options.prototype_axes = true;
  const Camera found = import::bouguet({file}, options).cameras[0];
  const Mat3 mat = glm::transpose(camera.R);         // Cam1_RotMat = Rc_1'
  const Vec3 trans = mat * -camera.t;                // Cam1_Trans
  const auto m = to_rows(mat);                       // RotTmp: its rows 2, -1, 3
  const Mat3 fixed = from_rows({-m[3], -m[4], m[5],  // RotationFixed: columns -1, -2, 3
                                m[0], m[1], -m[2], -m[6], -m[7], m[8]});
  EXPECT_LT(glm::length(found.centre() - Vec3(trans.y, -trans.x, trans.z)), 1e-9);
  // Its camera: x left, y up, z forward.
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 mine = glm::transpose(found.R)[axis] * (axis < 2 ? -1.0 : 1.0);
    EXPECT_LT(glm::length(mine - fixed[axis]), 1e-14);
  }
}

// Whatever the bytes: a valid rig, or one Error.
void feed_broken(const std::string& good, unsigned seed, int times,
                 const std::function<void(const std::string&)>& read) {
  std::mt19937 random(seed);
  const std::string splices[] = {"[",  "{",   "]",  "-",  "1e999", "nan", ": ",
                                 "\n", "&a ", "*a", "\"", "\xff",  "0"};
  for (int i = 0; i < times; ++i) {
    std::string text = good;
    for (unsigned n = random() % 4 + 1; n > 0 && !text.empty(); --n) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text.resize(at);
          break;
        case 1:
          text.erase(at, random() % 40);
          break;
        case 2:
          text[at] = static_cast<char>(random());
          break;
        default:
          text.insert(at, splices[random() % std::size(splices)]);
      }
    }
    try {
      read(text);
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()), "");
    }
  }
  for (const char* piece : {"[", "{", "- ", "a: [", "{\"a\":", "x = [ 1 "}) {
    std::string deep;
    while (deep.size() < 50000) deep += piece;
    EXPECT_THROW(read(deep), Error) << piece;
  }
}

TEST(RigExchange, BrokenFilesAreRefused) {
  feed_broken(kalibr_file, 1, 1000,
              [](const std::string& text) { import::parse_kalibr(text, "test"); });
  feed_broken(opentrackio_file, 2, 1000,
              [](const std::string& text) { import::parse_opentrackio(text, "test", {}); });
  const std::string folder = empty_folder("broken");
  const Rig rig = random_rig(7, 5);
  exported::colmap(rig, folder + "/colmap");
  exported::opencv(rig, folder + "/opencv");
  const auto by_file = [](const std::string& path, unsigned seed,
                          const std::function<void()>& read) {
    feed_broken(read_text(path), seed, 200, [&](const std::string& text) {
      write_text(text, path);
      read();
    });
  };
  const std::string yaml = files_in(folder + "/opencv").front();
  by_file(yaml, 3, [&] { import::opencv({yaml}, {}); });
  by_file(folder + "/colmap/images.txt", 4, [&] { import::colmap(folder + "/colmap", {}); });
  exported::colmap(rig, folder + "/colmap");
  by_file(folder + "/colmap/cameras.txt", 5, [&] { import::colmap(folder + "/colmap", {}); });
  const std::string matlab = folder + "/Calib_Results.m";
  write_text(
      "fc = [ 700 ; 700 ];\ncc = [ 320 ; 240 ];\nkc = [ 0 ; 0 ; 0 ; 0 ; 0 ];\nnx = 640;\nny = "
      "480;\n"
      "omc_1 = [ 0.1 ; 0.2 ; 0.3 ];\nTc_1  = [ 0 ; 0 ; 3 ];\n",
      matlab);
  by_file(matlab, 6, [&] { import::bouguet({matlab}, {}); });
}

}  // namespace
}  // namespace polyhull
