// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/import.h"

#include <gtest/gtest.h>

#include <cstdarg>
#include <filesystem>
#include <fstream>
#include <functional>

#include "base/error.h"
#include "builtin/default_rig.h"
#include "rig/check.h"
#include "support/refusal.h"

namespace polyhull {
namespace {

std::string data(const std::string& file) {
  const char* folder = std::getenv("POLYHULL_DATA");
  return std::string(folder ? folder : "") + "/" + file;
}

#define NEED(file)                          \
  if (!std::filesystem::exists(data(file))) \
  GTEST_SKIP() << "needs " << file << " under $POLYHULL_DATA"

std::filesystem::path folder(const std::string& name = "") {
  const auto path = std::filesystem::temp_directory_path() / "polyhull_rig_import" / name;
  std::filesystem::create_directories(path);
  return path;
}

std::string printed(const char* pattern, ...) {
  char text[2048];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

void expect_same(const Camera& a, const Camera& b, double tolerance) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(glm::length(a.K[i] - b.K[i]), tolerance);
    EXPECT_LT(glm::length(a.R[i] - b.R[i]), tolerance);
  }
  EXPECT_LT(glm::length(a.t - b.t), tolerance);
  ASSERT_EQ(a.distortion.size(), b.distortion.size());
  for (std::size_t i = 0; i < a.distortion.size(); ++i)
    EXPECT_NEAR(a.distortion[i], b.distortion[i], tolerance);
}

TEST(RigImport, Middlebury) {
  NEED("middlebury_dinoSparseRing/dinoSR_par.txt");
  const Rig rig = import::middlebury(data("middlebury_dinoSparseRing/dinoSR_par.txt"), {});
  ASSERT_EQ(rig.cameras.size(), 16u);
  const Camera& camera = rig.cameras[0];
  EXPECT_EQ(camera.name, "dinoSR0001");
  EXPECT_EQ(camera.width, 640);
  EXPECT_EQ(camera.height, 480);
  EXPECT_EQ(camera.K[0][0], 3310.4);
  EXPECT_EQ(camera.K[1][1], 3325.5);
  EXPECT_EQ(camera.K[2][0], 316.73);
  EXPECT_NEAR(camera.R[1][0], 0.96965263281337499, 1e-6);  // row 0, column 1
  EXPECT_EQ(camera.t, Vec3(-0.010415508744, -0.0294278883669, 0.673097816109));
  // The object's box (from the data's README) lies in front of all cameras, nearly all of it in
  // view.
  for (const Camera& c : rig.cameras) {
    const auto pixel = c.project(Vec3(-0.0255, 0.0247, -0.0212));
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(pixel->x, 375, 30);
    EXPECT_NEAR(pixel->y, 220, 40);
  }
}

TEST(RigImport, ProjectionMatrices) {
  NEED("oxford_dino/dino_Ps_metric.txt");
  import::Options options;
  options.width = 720;
  options.height = 576;
  options.name = "viff.%03d";
  const Rig rig = import::projection_matrices({data("oxford_dino/dino_Ps_metric.txt")}, options);
  ASSERT_EQ(rig.cameras.size(), 36u);
  EXPECT_EQ(rig.cameras[35].name, "viff.035");
  for (const Camera& camera : rig.cameras) {
    EXPECT_NEAR(camera.K[0][0], 2869, 5);
    EXPECT_NEAR(camera.K[2][0], 325, 5);
    EXPECT_NEAR(camera.K[2][1], 289, 5);
    EXPECT_NEAR(glm::length(camera.centre()), 1.0, 0.01);
  }
  NEED("oxford_dino/dino_Ps.txt");
  const std::string message = test::refusal_of(
      [&] { import::projection_matrices({data("oxford_dino/dino_Ps.txt")}, options); });
  EXPECT_NE(message.find("left-handed"), std::string::npos) << message;
  EXPECT_NE(message.find("dino_Ps.txt, line"), std::string::npos) << message;
}

TEST(RigImport, Text) {
  NEED("utrecht_voxel/calibration_resolved.txt");
  import::Options options;
  options.width = 644;
  options.height = 486;
  const Rig rig = import::text(data("utrecht_voxel/calibration_resolved.txt"), options);
  ASSERT_EQ(rig.cameras.size(), 4u);
  EXPECT_EQ(rig.cameras[2].name, "cam3");
  EXPECT_EQ(rig.cameras[2].K[0][0], 491.795929);
  EXPECT_EQ(rig.cameras[2].distortion[0], -0.356171161);
  // Camera heights of 1.37 to 1.45 m, z down (PROVENANCE.txt).
  for (const Camera& camera : rig.cameras) {
    EXPECT_GT(-camera.centre().z, 1350);
    EXPECT_LT(-camera.centre().z, 1460);
  }
}

TEST(RigImport, OpenCvFilesNamedByTheirFolders) {
  NEED("utrecht_voxel/cam1/config.xml");
  import::Options options;
  options.width = 644;
  options.height = 486;
  std::vector<std::string> files;
  for (int i = 1; i <= 4; ++i)
    files.push_back(data("utrecht_voxel/cam" + std::to_string(i) + "/config.xml"));
  const Rig rig = import::opencv(files, options);
  ASSERT_EQ(rig.cameras.size(), 4u);
  EXPECT_EQ(rig.cameras[0].name, "cam1");
  // The file stores single precision.
  EXPECT_NEAR(rig.cameras[0].K[0][0], 490.756439, 1e-4);
  ASSERT_EQ(rig.cameras[0].distortion.size(), 5u);
  EXPECT_NEAR(rig.cameras[0].distortion[4], -0.0712014362, 1e-8);
  EXPECT_NEAR(rig.cameras[0].t.z, 5836.3675636221933, 1e-6);
  const Mat3 expected =
      import::rotation_of(Vec3(-1.3729877816020433, 0.49613357894194315, 0.61391054843037529));
  for (int i = 0; i < 3; ++i) EXPECT_LT(glm::length(rig.cameras[0].R[i] - expected[i]), 1e-12);
  const std::string message = test::refusal_of([&] { import::opencv(files, {}); });
  EXPECT_NE(message.find("--size"), std::string::npos) << message;
}

TEST(RigImport, OpenCvStereoPair) {
  NEED("stereo_chessboard_ir/extrinsics.yml");
  import::Options options;
  options.width = 640;
  options.height = 480;
  const Rig rig = import::opencv(
      {data("stereo_chessboard_ir/intrinsics.yml"), data("stereo_chessboard_ir/extrinsics.yml")},
      options);
  ASSERT_EQ(rig.cameras.size(), 2u);
  const double baseline = glm::length(rig.cameras[1].centre() - rig.cameras[0].centre());
  EXPECT_NEAR(baseline,
              glm::length(Vec3(91.204379214855877, -2.6467940379585433, 12.201294785624963)), 1e-9);
}

TEST(RigImport, RodriguesFormula) {
  const Mat3 quarter = import::rotation_of(Vec3(0, 0, M_PI / 2));
  EXPECT_LT(glm::length(quarter * Vec3(1, 0, 0) - Vec3(0, 1, 0)), 1e-15);
  EXPECT_EQ(import::rotation_of(Vec3(0)), Mat3(1.0));
}

Vec3 rodrigues(const Mat3& R) {
  const double angle = std::acos((R[0][0] + R[1][1] + R[2][2] - 1) / 2);
  return angle / (2 * std::sin(angle)) *
         Vec3(R[1][2] - R[2][1], R[2][0] - R[0][2], R[0][1] - R[1][0]);
}

TEST(RigImport, BouguetComesBack) {
  Rig truth = default_rig();
  std::vector<std::string> files;
  for (Camera& camera : truth.cameras) {
    camera.distortion = {-0.2, 0.05, 1e-3, -2e-3, 0.01};
    camera.K[1][0] = 0.001 * camera.K[0][0];
    const auto file = folder(camera.name) / "Calib_Results.m";
    files.push_back(file.string());
    const Vec3 om = rodrigues(camera.R);
    std::ofstream(file) << "% Intrinsic and Extrinsic Camera Parameters\n\n%-- Focal length:\n"
                        << printed("fc = [ %.15f ; %.15f ];\n\n", camera.K[0][0], camera.K[1][1])
                        << printed("cc = [ %.15f ; %.15f ];\nalpha_c = %.15f;\n", camera.K[2][0],
                                   camera.K[2][1], 0.001)
                        << "kc = [ -0.200000000 ; 0.05 ; 1e-3 ; -2e-3 ; 0.01 ];\n"
                        << "fc_error = [ 1 ; 2 ];\nnx = 1024;\nny = 768;\n"
                        << "omc_1 = [ 9 ; 9 ; 9 ];\nTc_1  = [ 0 ; 0 ; 0 ];\n"
                        << printed("omc_2 = [ %.15e ; %.15e ; %.15e ];\n", om.x, om.y, om.z)
                        << printed("Tc_2  = [ %.15e ; %.15e ; %.15e ];\n", camera.t.x, camera.t.y,
                                   camera.t.z);
  }
  import::Options options;
  options.board = 2;
  const Rig rig = import::bouguet(files, options);
  ASSERT_EQ(rig.cameras.size(), 4u);
  for (int i = 0; i < 4; ++i) expect_same(rig.cameras[i], truth.cameras[i], 1e-9);
  options.board = 3;
  EXPECT_NE(test::refusal_of([&] { import::bouguet(files, options); }).find("omc_3"),
            std::string::npos);
}

// The pose as the toolbox's extrinsic calibration writes it: a matrix, row by row.
TEST(RigImport, BouguetsMatrixIsThePose) {
  const Rig truth = default_rig();
  std::vector<std::string> files;
  for (const Camera& camera : truth.cameras) {
    const auto file = folder(camera.name) / "Calib_Results_extrinsic.m";
    files.push_back(file.string());
    const auto row = [&](int i) {
      return printed("%.17g , %.17g , %.17g", camera.R[0][i], camera.R[1][i], camera.R[2][i]);
    };
    std::ofstream(file) << printed("fc = [ %.15f ; %.15f ];\n", camera.K[0][0], camera.K[1][1])
                        << printed("cc = [ %.15f ; %.15f ];\n", camera.K[2][0], camera.K[2][1])
                        << "nx = 1024;\nny = 768;\n"
                        << "Rc_ext = [ " << row(0) << " ; " << row(1) << " ; " << row(2) << " ];\n"
                        << printed("Tc_ext = [ %.17g ; %.17g ; %.17g ];\n", camera.t.x, camera.t.y,
                                   camera.t.z);
  }
  const Rig rig = import::bouguet(files, {});
  ASSERT_EQ(rig.cameras.size(), 4u);
  for (int i = 0; i < 4; ++i) expect_same(rig.cameras[i], truth.cameras[i], 1e-9);
}

TEST(RigImport, ColmapComesBackWithItsHalfPixel) {
  Rig truth = default_rig();
  const auto path = folder("colmap");
  std::ofstream cameras(path / "cameras.txt"), images(path / "images.txt");
  cameras << "# Camera list\n";
  images << "# Image list\n";
  int id = 1;
  for (Camera& camera : truth.cameras) {
    camera.distortion = {-0.1, 0.02, 1e-3, 2e-3};
    cameras << id
            << printed(" OPENCV 1024 768 700 700 %.3f %.3f -0.1 0.02 0.001 0.002\n", 512.0, 384.0);
    const Vec3 om = rodrigues(camera.R);
    const double angle = glm::length(om);
    const Vec3 q = std::sin(angle / 2) / angle * om;
    images << printed("%d %.17g %.17g %.17g %.17g %.17g %.17g %.17g %d sub/%s.jpg\n", id,
                      std::cos(angle / 2), q.x, q.y, q.z, camera.t.x, camera.t.y, camera.t.z, id,
                      camera.name.c_str())
           << (id % 2 ? "\n" : "1.5 2.5 -1 3 4 17\n");
    ++id;
  }
  cameras.close();
  images.close();
  const Rig rig = import::colmap(path.string(), {});
  ASSERT_EQ(rig.cameras.size(), 4u);
  for (int i = 0; i < 4; ++i) expect_same(rig.cameras[i], truth.cameras[i], 1e-9);
}

TEST(RigImport, BadFilesAreNamedWithTheirLine) {
  const auto path = (folder() / "bad.txt").string();
  const auto refuses = [&](const std::string& content, auto importer, const std::string& part) {
    std::ofstream(path) << content;
    const std::string message = test::refusal_of([&] { importer(); });
    EXPECT_NE(message.find("bad.txt"), std::string::npos) << message;
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  import::Options sized;
  sized.width = sized.height = 100;
  const auto middlebury = [&] { import::middlebury(path, sized); };
  const auto matrices = [&] { import::projection_matrices({path}, sized); };
  refuses("2\na.png 1 2 3\n", middlebury, "line 2: expected 21 numbers, found 3");
  refuses("2\na.png 700 0 50 0 700 50 0 0 1 1 0 0 0 1 0 0 0 1 0 0 x\n", middlebury, "'x'");
  refuses("2\na.png 700 0 50 0 700 50 0 0 1 1 0 0 0 1 0 0 0 1 0 0 1\n", middlebury, "promises 2");
  refuses("1 0 0 0 0 1 0 0 0 0 1\n", matrices, "found 11");
  refuses("1 0 0 0\n0 1 0 0\n", matrices, "not complete");
  refuses("nan 0 0 0 0 1 0 0 0 0 1 0\n", matrices, "not finite");
  refuses("0 0 0 0 0 0 0 0 0 0 0 0\n", matrices, "singular");
  refuses(
      "", [&] { import::text(path, sized); }, "no cameras");
  refuses(
      "<xml", [&] { import::opencv({path}, sized); }, "OpenCV");
  EXPECT_NE(test::refusal_of([&] { import::colmap("/nowhere", {}); }).find("cameras.txt"),
            std::string::npos);
  import::Options bad_name = sized;
  bad_name.name = "%s%n";
  std::ofstream(path) << "1 0 0 0 0 1 0 0 0 0 1 0\n";
  EXPECT_THROW(import::projection_matrices({path}, bad_name), Error);
}

TEST(RigCheck, FindsWhatIsWrong) {
  EXPECT_TRUE(examine_rig(default_rig()).warnings.empty());
  const auto warnings = [](const std::function<void(Rig&)>& change) {
    Rig rig = default_rig();
    change(rig);
    std::string all;
    for (const std::string& warning : examine_rig(rig).warnings) all += warning + "\n";
    return all;
  };
  EXPECT_NE(warnings([](Rig& r) { r.cameras[0].t.z = -r.cameras[0].t.z; }).find("cam0"),
            std::string::npos);
  EXPECT_NE(warnings([](Rig& r) {
              r.cameras[1] = r.cameras[0];
              r.cameras[1].name = "x";
            }).find("same place"),
            std::string::npos);
  EXPECT_NE(warnings([](Rig& r) { r.cameras[1].K[2][0] = 3000; }).find("principal point"),
            std::string::npos);
  EXPECT_NE(warnings([](Rig& r) {
              r.cameras[1].width *= 2;
              r.cameras[1].height *= 2;
            }).find("cam1 has its principal point"),
            std::string::npos);
  EXPECT_NE(warnings([](Rig& r) {
              r.cameras[2].distortion = {-0.9, 0, 0, 0};
            }).find("inverted"),
            std::string::npos);
  EXPECT_NE(warnings([](Rig& r) { r.cameras.resize(1); }).find("two cameras"), std::string::npos);
}

}  // namespace
}  // namespace polyhull
