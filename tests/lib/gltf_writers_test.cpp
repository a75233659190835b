// SPDX-License-Identifier: LGPL-2.1-or-later
// What writers of glTF files leave out, add, or spell in their own way.
#include <fstream>

#include "base/picture.h"
#include "scene_file.h"

namespace polyhull {
namespace {

class GltfWriters : public SceneFile {
 protected:
  /// What is said to be left out of \p root, which is read.
  std::string left_out(const json& root) { return load_scene(write(root)).left_out; }

  /// triangle_file() with \p light at its node.
  json lit_file(const json& light) {
    json root = triangle_file();
    root["extensions"]["KHR_lights_punctual"]["lights"] = json::array({light});
    root["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
    return root;
  }

  json textured_file(const std::string& uri) {
    json root = triangle_file();
    root["materials"] = json::array(
        {{{"name", "brick"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}});
    root["textures"] = json::array({{{"source", 0}}});
    root["images"] = json::array({{{"uri", uri}}});
    root["meshes"][0]["primitives"][0]["material"] = 0;
    return root;
  }
};

TEST_F(GltfWriters, WhatHasADefaultMayBeMissing) {
  for (const json& asset :
       {json(), json::object(), json{{"version", 2.0}}, json{{"version", nullptr}}}) {
    json root = triangle_file();
    root["asset"] = asset;
    if (asset.is_null()) root.erase("asset");
    EXPECT_EQ(failure(write(root)), "") << asset;
  }
  json old = triangle_file();
  old["asset"]["version"] = 1.0;
  EXPECT_TRUE(contains(failure(write(old)), "is a file of glTF 1.0"));
  EXPECT_NEAR(load_scene(write(lit_file({{"type", "spot"}}))).lights.at(0).outer_cone, 0.7853982f,
              1e-6f);
}

TEST_F(GltfWriters, StridesOfAnyLength) {
  for (const int stride : {0, 12, 14, 300}) {
    json root = triangle_file();
    std::string bytes;
    for (const float x : {0.0f, 1.0f, 2.0f}) {
      const float p[] = {x, x * x, 3.0f};
      bytes.append(reinterpret_cast<const char*>(p), sizeof p);
      if (stride > 12) bytes.append(static_cast<std::size_t>(stride) - sizeof p, '\xFF');
    }
    std::ofstream(folder_ / "data.bin", std::ios::binary) << bytes;
    root["buffers"][0]["byteLength"] = root["bufferViews"][0]["byteLength"] = bytes.size();
    root["bufferViews"][0]["byteStride"] = stride;
    EXPECT_EQ(load_scene(write(root)).meshes.at(0).positions.at(2), Vec3f(2.0f, 4.0f, 3.0f))
        << stride;
  }
  json root = triangle_file();
  root["bufferViews"][0]["byteStride"] = 4;
  EXPECT_TRUE(contains(failure(write(root)), "reaches beyond its buffer"));
}

TEST_F(GltfWriters, PartsThatAreNotDrawnAreSaid) {
  json root = triangle_file();
  json& primitives = root["meshes"][0]["primitives"];
  primitives.push_back({{"attributes", json::object()}});
  EXPECT_EQ(left_out(root), "meshes without positions");
  EXPECT_EQ(load_scene(write(root)).meshes.size(), 1u);

  for (const char* type : {"ambient", "area"}) {
    EXPECT_EQ(left_out(lit_file({{"type", type}})),
              "lights of other types than point, spot and directional");
    EXPECT_TRUE(load_scene(write(lit_file({{"type", type}}))).lights.empty());
  }

  root = triangle_file();
  root["materials"] = json::array({{{"extensions", {{"KHR_materials_unlit", json::object()}}}}});
  EXPECT_EQ(left_out(root), "unlit materials (the scene lights them)");

  root = triangle_file();
  root["nodes"][0]["camera"] = 0;
  root["cameras"] =
      json::array({{{"type", "perspective"}, {"perspective", {{"yfov", 50.0}, {"znear", 0.1}}}}});
  EXPECT_EQ(left_out(root), "cameras whose field of view is 180 degrees or more");
}

TEST_F(GltfWriters, InvisibleNodesAreNotDrawn) {
  json root = triangle_file();
  root["extensionsRequired"] = root["extensionsUsed"] = {"KHR_node_visibility"};
  root["scenes"][0]["nodes"] = {0, 1};
  root["nodes"].push_back({{"name", "hidden"}, {"children", {2}}});
  root["nodes"].push_back({{"name", "with it"}, {"mesh", 0}});
  for (const bool visible : {true, false}) {
    root["nodes"][1]["extensions"]["KHR_node_visibility"]["visible"] = visible;
    EXPECT_EQ(load_scene(write(root)).meshes.size(), visible ? 2u : 1u);
  }
}

// On Windows capitals do not count, and some write where the file was when they read it.
TEST_F(GltfWriters, FilesOfOtherSystemsAreFoundBesideTheScene) {
  const Picture grey{1, 1, 3, {9, 9, 9}};
  std::filesystem::create_directories(folder_ / "Maps");
  save_picture(grey, (folder_ / "Maps" / "Wall.png").string());
  save_picture(grey, (folder_ / "floor.png").string());
  for (const char* uri :
       {"Maps/WALL.PNG", "Maps\\wall.png", "FLOOR.png", "C:\\Users\\me\\stage\\floor.png",
        "file:///C:/Users/me/Floor.png", "/home/me/stage/floor.png", "textures/floor.png"})
    EXPECT_EQ(load_scene(write(textured_file(uri))).textures.size(), 1u) << uri;
  EXPECT_EQ(left_out(textured_file("floor.png")),
            "textures (of meshes without their texture coordinates)");
  // Which of two is meant, nobody knows.
  save_picture(grey, (folder_ / "FLOOR.PNG").string());
  EXPECT_TRUE(contains(failure(write(textured_file("Floor.png"))), "is missing or empty"));
  EXPECT_EQ(failure(write(textured_file("floor.png"))), "");
}

}  // namespace
}  // namespace polyhull
