// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: the reader of glTF scenes. It reads files: one in the folder for temporary ones, of
// this process, in a folder of its own, where an address in it leads to nothing else.
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "base/error.h"
#include "scene/scene.h"

namespace {

const std::filesystem::path& file() {
  static const std::filesystem::path path = [] {
    const auto folder =
        std::filesystem::temp_directory_path() / ("scene_fuzzer_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
    return folder / "scene.gltf";
  }();
  return path;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::ofstream(file(), std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  try {
    const polyhull::Scene scene = polyhull::load_scene(file().string());
    for (const polyhull::SceneMesh& mesh : scene.meshes) {
      if (mesh.material < 0 || static_cast<std::size_t>(mesh.material) >= scene.materials.size())
        std::abort();
      for (const std::uint32_t corner : mesh.triangles)
        if (corner >= mesh.positions.size()) std::abort();
    }
  } catch (const polyhull::Error&) {
  }
  return 0;
}
