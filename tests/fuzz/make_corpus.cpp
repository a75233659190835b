// SPDX-License-Identifier: LGPL-2.1-or-later
// Writes one good example per fuzzer into FOLDER/view, FOLDER/mesh and FOLDER/rig to start from.
#include <filesystem>
#include <fstream>
#include <iostream>

#include "../lib/wire_examples.h"
#include "studio/cameras/default_rig.h"
#include "wire/mesh_payload.h"
#include "wire/view_payload.h"

int main(int count, char** arguments) {
  using namespace polyhull;
  if (count != 2) {
    std::cerr << "usage: make-corpus FOLDER\n";
    return 1;
  }
  const auto write = [&](const char* kind, const auto& bytes) {
    const std::filesystem::path folder = std::filesystem::path(arguments[1]) / kind;
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "example", std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  const std::vector<std::uint8_t> a = examples::pixels(840, 1), b = examples::pixels(840, 2);
  write("view", write_view(examples::view("cam0", a)));
  write("mesh", write_mesh(examples::mesh(a, b)));
  write("rig", rig_to_json(default_rig()));
}
