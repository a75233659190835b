// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/rig.h"

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "builtin/default_rig.h"
#include "rig/projection_matrix.h"
#include "support/refusal.h"

namespace polyhull {
namespace {

using nlohmann::json;

json good() {
  return json::parse(rig_to_json(default_rig()));
}

// Parses the default rig after a change and checks that the message has all parts.
void expect_refused(const std::function<void(json&)>& change,
                    const std::vector<std::string>& parts) {
  json rig = good();
  change(rig);
  const std::string message = test::refusal_of([&] { parse_rig(rig.dump(), "stage.json"); });
  EXPECT_NE(message.find("stage.json"), std::string::npos) << message;
  for (const std::string& part : parts)
    EXPECT_NE(message.find(part), std::string::npos) << part << " not in: " << message;
}

bool same(const Camera& a, const Camera& b) {
  return a.name == b.name && a.width == b.width && a.height == b.height && a.K == b.K &&
         a.R == b.R && a.t == b.t && a.distortion == b.distortion && a.colour == b.colour;
}

TEST(Rig, DefaultSeesAPersonFully) {
  const Rig rig = default_rig();
  ASSERT_EQ(rig.cameras.size(), 4u);
  EXPECT_NO_THROW(validate_rig(rig, "default"));
  for (const Camera& camera : rig.cameras) {
    EXPECT_NEAR(camera.centre().y, 1.4, 0.11);
    EXPECT_NE(rig.find(camera.name), nullptr);
    // Anywhere within 40 cm of the middle, arms spread to 1.6 m.
    for (const double x : {-0.8, 0.8})
      for (const double z : {-0.4, 0.4})
        for (const double y : {0.0, 1.8}) {
          const auto pixel = camera.project(Vec3(x, y, z));
          ASSERT_TRUE(pixel);
          EXPECT_GT(pixel->x, 0.0);
          EXPECT_LT(pixel->x, camera.width - 1.0);
          EXPECT_GT(pixel->y, 0.0);
          EXPECT_LT(pixel->y, camera.height - 1.0);
        }
    // Upright: the head is above the feet on screen.
    EXPECT_LT(camera.project(Vec3(0, 1.8, 0))->y, camera.project(Vec3(0, 0, 0))->y);
  }
}

TEST(Rig, ComesBackFromItsFileExactly) {
  Rig rig = default_rig();
  rig.cameras[1].distortion = {-0.3, 0.1, 1e-4, -2e-5, 0.01};
  rig.cameras[1].colour = from_rows({1.1, 0.1, -0.1, 0.0, 0.9, 0.05, -0.2, 0.1, 1.0 / 3.0});
  rig.cameras[2].name = "left \"wing\"\\\n";
  rig.unit = "mm";
  rig.up = Vec3(0, 0, -1);
  const Rig read = parse_rig(rig_to_json(rig), "x");
  ASSERT_EQ(read.cameras.size(), rig.cameras.size());
  for (std::size_t i = 0; i < rig.cameras.size(); ++i)
    EXPECT_TRUE(same(read.cameras[i], rig.cameras[i])) << i;
  EXPECT_EQ(read.unit, "mm");
  EXPECT_EQ(read.metres_per_unit(), 0.001);
  EXPECT_EQ(read.up, rig.up);
  ASSERT_TRUE(read.bounds);
  EXPECT_EQ(read.bounds->min, rig.bounds->min);
  EXPECT_EQ(read.bounds->max, rig.bounds->max);
  EXPECT_EQ(read.find("nobody"), nullptr);
}

TEST(Rig, MissingFileIsNamed) {
  const std::string message = test::refusal_of([] { load_rig("/nowhere/rig.json"); });
  EXPECT_NE(message.find("/nowhere/rig.json"), std::string::npos) << message;
  EXPECT_THROW(load_rig("/tmp"), Error);
  EXPECT_NE(test::refusal_of([] { load_rig("/dev/null"); }), "");
}

TEST(Rig, NotJsonTellsLineAndColumn) {
  const std::string message = test::refusal_of(
      [] { parse_rig("{\n  \"format\": \"polyhull-rig\",\n  oops\n}", "stage.json"); });
  EXPECT_NE(message.find("stage.json"), std::string::npos) << message;
  EXPECT_NE(message.find("line 3, column 3"), std::string::npos) << message;
  EXPECT_NE(test::refusal_of([] { parse_rig("", "x"); }), "");
  EXPECT_NE(test::refusal_of([] { parse_rig("[1, 2]", "x"); }), "");
  EXPECT_NE(test::refusal_of([] { parse_rig("\"\xff\xfe\"", "x"); }), "");
  EXPECT_NE(test::refusal_of([] { parse_rig(std::string(100000, '['), "x"); }), "");
  std::string text = rig_to_json(default_rig());
  text.replace(text.find("700.0"), 5, std::string(1000000, '[') + std::string(1000000, ']'));
  EXPECT_EQ(test::refusal_of([&] { parse_rig(text, "stage.json"); }),
            "stage.json: more than 64 brackets within each other.");
}

TEST(Rig, NanAndInfinityAreRefused) {
  std::string text = rig_to_json(default_rig());
  text.replace(text.find("700.0"), 5, "NaN");
  const std::string message = test::refusal_of([&] { parse_rig(text, "stage.json"); });
  EXPECT_NE(message.find("line 12, column 14"), std::string::npos) << message;
  EXPECT_NE(message.find("NaN"), std::string::npos) << message;
  text.replace(text.find("NaN"), 3, "1e999");
  EXPECT_NE(test::refusal_of([&] { parse_rig(text, "stage.json"); }), "");
  expect_refused([](json& r) { r["cameras"][0]["K"][0][0] = nullptr; },
                 {"cam0", "K[0][0]", "expected a number"});
  Rig rig = default_rig();
  rig.cameras[3].t.y = std::nan("");
  EXPECT_THROW(validate_rig(rig, "x"), Error);
  rig = default_rig();
  rig.cameras[3].R[1][1] = INFINITY;
  EXPECT_THROW(validate_rig(rig, "x"), Error);
}

TEST(Rig, WrongContentIsRefusedWithItsPlace) {
  expect_refused([](json& r) { r["format"] = "other"; }, {"polyhull-rig"});
  expect_refused([](json& r) { r["version"] = 2; }, {"version 2", "version 1"});
  expect_refused([](json& r) { r.erase("version"); }, {"'version' is missing"});
  expect_refused([](json& r) { r.erase("cameras"); }, {"'cameras' is missing"});
  expect_refused([](json& r) { r["cameras"] = json::array(); }, {"no cameras"});
  expect_refused([](json& r) { r["cameras"][2]["name"] = "cam0"; },
                 {"cameras[2]", "cam0", "same name"});
  expect_refused([](json& r) { r["cameras"][2]["name"] = ""; }, {"cameras[2]", "empty"});
  expect_refused([](json& r) { r["cameras"][1]["R"][0][0] = 2.0; },
                 {"cam1", "R is not a rotation", "orthonormal"});
  expect_refused(
      [](json& r) {
        for (auto& value : r["cameras"][1]["R"][2]) value = -value.get<double>();
      },
      {"cam1", "reflection", "left-handed"});
  expect_refused([](json& r) { r["cameras"][0]["K"][1][1] = 0; }, {"cam0", "focal length"});
  expect_refused([](json& r) { r["cameras"][0]["K"][0][0] = -700; }, {"cam0", "positive"});
  expect_refused([](json& r) { r["cameras"][0]["K"][1][0] = 1; }, {"cam0", "upper triangular"});
  expect_refused([](json& r) { r["cameras"][0]["K"].erase(2); }, {"cam0", "three rows"});
  expect_refused([](json& r) { r["cameras"][0]["t"] = {1, 2}; }, {"cam0", "three numbers"});
  expect_refused([](json& r) { r["cameras"][0]["t"] = "far"; }, {"cam0", "list of numbers"});
  expect_refused([](json& r) { r["cameras"][0]["width"] = 0; }, {"cam0", "picture size"});
  expect_refused([](json& r) { r["cameras"][0]["width"] = 1.5; }, {"cam0", "whole number"});
  expect_refused(
      [](json& r) {
        r["cameras"][0]["distortion"] = {1, 2, 3};
      },
      {"cam0", "3 coefficients"});
  expect_refused([](json& r) { r["bounds"]["max"][1] = -1; }, {"inside out", "y"});
  expect_refused([](json& r) { r["bounds"].erase("min"); }, {"bounds", "min"});
  expect_refused([](json& r) { r["up"] = {0, 0, 0}; }, {"up"});
  expect_refused([](json& r) { r["unit"] = "parsec"; }, {"parsec", "mm"});
  expect_refused([](json& r) { r["unit"] = "-1"; }, {"unit"});
  expect_refused([](json& r) { r["cameras"][0] = 7; }, {"cameras[0]", "object"});
  expect_refused(
      [](json& r) {
        r["cameras"][0]["P"] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
      },
      {"cam0", "both P and K"});
}

TEST(Rig, RotationsOfFewDigitsBecomeRotations) {
  json rig = good();
  for (auto& camera : rig["cameras"])
    for (auto& row : camera["R"])
      for (auto& value : row) value = std::round(value.get<double>() * 1e6) / 1e6;
  const Rig read = parse_rig(rig.dump(), "x");
  for (const Camera& camera : read.cameras) {
    const Mat3 off = camera.R * glm::transpose(camera.R) - Mat3(1.0);
    for (int i = 0; i < 3; ++i) EXPECT_LT(glm::length(off[i]), 1e-13);
    EXPECT_NEAR(camera.R[0][0], default_rig().find(camera.name)->R[0][0], 2e-6);
  }
}

ProjectionMatrix projection_of(const Camera& camera, double scale) {
  const auto m = to_rows(camera.K * camera.R);
  const Vec3 p = camera.K * camera.t;
  ProjectionMatrix P;
  for (int i = 0; i < 3; ++i)
    P[i] = {scale * m[3 * i], scale * m[3 * i + 1], scale * m[3 * i + 2], scale * p[i]};
  return P;
}

json with_matrices(double scale, bool bounds) {
  json rig = good();
  const Rig truth = default_rig();
  for (std::size_t i = 0; i < truth.cameras.size(); ++i) {
    json& camera = rig["cameras"][i];
    camera.erase("K");
    camera.erase("R");
    camera.erase("t");
    // The sign of a projection matrix is arbitrary, camera by camera.
    camera["P"] = projection_of(truth.cameras[i], i % 2 == 0 ? scale : -scale);
  }
  if (!bounds) rig.erase("bounds");
  return rig;
}

TEST(Rig, ProjectionMatricesOfAnyScaleAndSign) {
  const Rig truth = default_rig();
  for (const double scale : {1.0, -3e-7, 5e8})
    for (const bool bounds : {true, false}) {
      const Rig read = parse_rig(with_matrices(scale, bounds).dump(), "x");
      for (std::size_t i = 0; i < truth.cameras.size(); ++i) {
        const Camera& a = read.cameras[i];
        const Camera& b = truth.cameras[i];
        EXPECT_GT(a.K[0][0], 0.0);
        for (int j = 0; j < 3; ++j) {
          EXPECT_LT(glm::length(a.K[j] - b.K[j]), 1e-9);
          EXPECT_LT(glm::length(a.R[j] - b.R[j]), 1e-12);
        }
        EXPECT_LT(glm::length(a.t - b.t), 1e-11);
      }
    }
}

TEST(Rig, LeftHandedAndSingularMatricesAreRefused) {
  for (const bool bounds : {true, false}) {
    json rig = with_matrices(1.0, bounds);
    for (auto& camera : rig["cameras"])
      for (auto& row : camera["P"]) row[2] = -row[2].get<double>();
    const std::string message = test::refusal_of([&] { parse_rig(rig.dump(), "stage.json"); });
    EXPECT_NE(message.find("left-handed"), std::string::npos) << message;
    EXPECT_NE(message.find("negate the third column"), std::string::npos) << message;
  }
  json rig = with_matrices(1.0, true);
  rig["cameras"][0]["P"][2] = rig["cameras"][0]["P"][1];
  EXPECT_NE(test::refusal_of([&] { parse_rig(rig.dump(), "x"); }).find("singular"),
            std::string::npos);
}

TEST(Rig, OxfordMatricesDecompose) {
  const char* data = std::getenv("POLYHULL_DATA");
  std::ifstream file(std::string(data ? data : "") + "/oxford_dino/dino_Ps_metric.txt");
  if (!file) GTEST_SKIP() << "needs oxford_dino under $POLYHULL_DATA";
  std::vector<ProjectionMatrix> matrices;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream row(line);
    ProjectionMatrix P;
    for (int i = 0; i < 12; ++i) row >> P[i / 4][i % 4];
    ASSERT_TRUE(row);
    matrices.push_back(P);
  }
  ASSERT_EQ(matrices.size(), 36u);
  const std::optional<Vec3> focus = common_focus(matrices);
  ASSERT_TRUE(focus);
  for (const ProjectionMatrix& P : matrices) {
    Camera camera;
    set_projection(camera, P, focus, "dino");
    EXPECT_NEAR(camera.K[0][0], 2869.0, 5.0);
    EXPECT_NEAR(camera.K[1][1], 2869.0, 5.0);
    EXPECT_NEAR(glm::length(Vec2(camera.centre())), 1.0, 0.01);  // the cameras' circle
    const Vec3 X(0.02, -0.03, 0.49);
    const Vec3 direct(P[0][0] * X.x + P[0][1] * X.y + P[0][2] * X.z + P[0][3],
                      P[1][0] * X.x + P[1][1] * X.y + P[1][2] * X.z + P[1][3],
                      P[2][0] * X.x + P[2][1] * X.y + P[2][2] * X.z + P[2][3]);
    EXPECT_LT(glm::length(*camera.project(X) - Vec2(direct) / direct.z), 1e-8);
  }
}

TEST(Rig, EveryUnitInMetres) {
  Rig rig;
  for (const auto& [unit, metres] : {std::pair{"m", 1.0},
                                     {"cm", 0.01},
                                     {"mm", 0.001},
                                     {"in", 0.0254},
                                     {"ft", 0.3048},
                                     {"0.37", 0.37}}) {
    rig.unit = unit;
    EXPECT_EQ(rig.metres_per_unit(), metres) << unit;
  }
}

}  // namespace
}  // namespace polyhull
