// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Small glTF files for tests, written to a folder that lives as long as the test.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "base/error.h"
#include "scene/scene.h"
#include "support/folder.h"
#include "support/refusal.h"

namespace polyhull {

using nlohmann::json;

class SceneFile : public testing::Test {
 protected:
  /// A .gltf file with one triangle whose data lie in data.bin beside it.
  json triangle_file() {
    const float numbers[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    std::ofstream(folder_ / "data.bin", std::ios::binary)
        .write(reinterpret_cast<const char*>(numbers), sizeof numbers);
    return {{"asset", {{"version", "2.0"}}},
            {"scene", 0},
            {"scenes", json::array({{{"nodes", {0}}}})},
            {"nodes", json::array({{{"mesh", 0}, {"name", "thing"}}})},
            {"meshes",
             json::array({{{"primitives", json::array({{{"attributes", {{"POSITION", 0}}}}})}}})},
            {"accessors",
             json::array(
                 {{{"bufferView", 0}, {"componentType", 5126}, {"count", 3}, {"type", "VEC3"}}})},
            {"bufferViews", json::array({{{"buffer", 0}, {"byteLength", 36}}})},
            {"buffers", json::array({{{"uri", "data.bin"}, {"byteLength", 36}}})}};
  }

  std::string write(const json& root) {
    const std::string path = folder_.file("scene.gltf");
    std::ofstream(path) << root.dump(1);
    return path;
  }

  /// The message with which loading fails.
  std::string failure(const std::string& path) {
    return test::refusal_of([&] { load_scene(path); });
  }

  const test::Folder folder_;
};

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace polyhull
