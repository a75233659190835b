// SPDX-License-Identifier: LGPL-2.1-or-later
// Small files that ask for much: they are refused, or read in a moment.
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "scene_file.h"

namespace polyhull {
namespace {

class SceneLimits : public SceneFile {
 protected:
  /// An accessor that stands for zeros.
  static int zeros(json& root, std::size_t count, const char* shape, int type = 5126) {
    root["accessors"].push_back({{"componentType", type}, {"count", count}, {"type", shape}});
    return static_cast<int>(root["accessors"].size()) - 1;
  }
  static void place_instances(json& root, std::size_t node, std::size_t count) {
    root["nodes"][node]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] =
        zeros(root, count, "VEC3");
  }
  static json& primitive(json& root) { return root["meshes"][0]["primitives"][0]; }
  /// Makes \p positions the data of the file's mesh.
  void set_positions(json& root, const std::vector<Vec3f>& positions) {
    const std::size_t size = positions.size() * sizeof(Vec3f);
    std::ofstream(folder_ / "data.bin", std::ios::binary)
        .write(reinterpret_cast<const char*>(positions.data()), static_cast<std::streamsize>(size));
    root["accessors"][0]["count"] = positions.size();
    root["bufferViews"][0]["byteLength"] = root["buffers"][0]["byteLength"] = size;
  }
};

TEST_F(SceneLimits, OneAccessorWithoutData) {
  json root = triangle_file();
  primitive(root)["attributes"]["POSITION"] = zeros(root, 16'777'215, "VEC3");
  EXPECT_TRUE(contains(failure(write(root)), "says 16777215 elements but has no data"));
}

TEST_F(SceneLimits, WhatAllNodesPlace) {
  // Instances that all fit, the first of which is refused for another reason when it is placed.
  json root = triangle_file();
  set_positions(root, std::vector<Vec3f>(3, Vec3f(NAN)));
  primitive(root)["indices"] = zeros(root, 36'000, "SCALAR", 5121);
  place_instances(root, 0, 1040);
  EXPECT_TRUE(contains(failure(write(root)), "not finite"));
  // One more node, whose mesh takes its part.
  root["meshes"].push_back(
      {{"primitives", {{{"attributes", {{"POSITION", zeros(root, 30'000, "VEC3")}}}}}}});
  root["nodes"].push_back({{"mesh", 1}});
  root["scenes"][0]["nodes"] = {1, 0};
  EXPECT_TRUE(contains(failure(write(root)), "is too large: with the 1040 instances"));
  // The same where its triangles need none of its vertices.
  root["meshes"][1]["primitives"][0]["indices"] = zeros(root, 3, "SCALAR", 5121);
  EXPECT_TRUE(contains(failure(write(root)), "is too large"));
}

TEST_F(SceneLimits, InstancesOfAVertexWithALongName) {
  json root = triangle_file();
  primitive(root)["attributes"]["POSITION"] = zeros(root, 1, "VEC3");
  root["nodes"][0]["name"] = std::string(std::size_t{16} * 437, 'n');
  place_instances(root, 0, 100'000);
  EXPECT_TRUE(contains(failure(write(root)), "is too large"));
}

TEST_F(SceneLimits, CamerasOfOneName) {
  constexpr int count = 10'000;
  json root = triangle_file();
  root["cameras"] =
      json::array({{{"type", "perspective"}, {"perspective", {{"yfov", 1.0}, {"znear", 0.1}}}}});
  for (int i = 0; i < count; ++i) {
    root["scenes"][0]["nodes"].push_back(i + 1);
    root["nodes"].push_back({{"camera", 0}, {"name", i == 1 ? "main (3)" : "main"}});
  }
  const std::vector<Camera> cameras = load_scene(write(root)).cameras;
  ASSERT_EQ(cameras.size(), static_cast<std::size_t>(count));
  EXPECT_EQ(cameras[2].name, "main (2)");
  EXPECT_EQ(cameras[3].name, "main (4)");
  EXPECT_EQ(cameras.back().name, "main (" + std::to_string(count) + ")");
}

TEST_F(SceneLimits, AnEmitterOfManyPiecesOnlyGlows) {
  json root = triangle_file();
  root["materials"] = json::array({{{"emissiveFactor", {1, 1, 1}}}});
  primitive(root)["material"] = 0;
  const auto make = [&](int pieces, std::size_t instances) {
    std::vector<Vec3f> positions;
    for (int i = 0; i < pieces; ++i) {
      const auto x = static_cast<float>(2 * i);
      for (const Vec2f& corner : {Vec2f(0, 0), {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}})
        positions.emplace_back(x + corner.x, corner.y, 0.0f);
    }
    set_positions(root, positions);
    place_instances(root, 0, instances);
  };
  const auto lamps = [&] {
    const Scene scene = load_scene(write(root));
    for (const SceneMesh& mesh : scene.meshes)
      EXPECT_EQ(scene.materials[mesh.material].emission, Vec3f(1.0f));
    return scene.lights.size();
  };
  for (const auto& [pieces, instances, expected] : {std::array{1, 256, 256},
                                                    {1, 257, 0},
                                                    {2, 128, 256},
                                                    {2, 129, 0},
                                                    {256, 1, 256},
                                                    {257, 1, 0}}) {
    make(pieces, static_cast<std::size_t>(instances));
    EXPECT_EQ(lamps(), static_cast<std::size_t>(expected)) << pieces << " " << instances;
  }
  make(1, 250);
  for (int i = 1; i < 5; ++i) {
    root["nodes"].push_back(root["nodes"][0]);
    root["scenes"][0]["nodes"].push_back(i);
  }
  EXPECT_EQ(lamps(), 1000u) << "of 1250";
}

}  // namespace
}  // namespace polyhull
