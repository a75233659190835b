// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: the reader of glTF scenes.
#include <cstdlib>

#include "base/error.h"
#include "input_file.h"
#include "scene/scene.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string file =
      polyhull::fuzz::input_file({reinterpret_cast<const char*>(data), size}, "scene.gltf");
  try {
    const polyhull::Scene scene = polyhull::load_scene(file);
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
