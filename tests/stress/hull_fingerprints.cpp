// SPDX-License-Identifier: LGPL-2.1-or-later
// Prints a fingerprint of the hull of each of many scenes. Built from the same sources for several
// instruction sets (meson.build); hull_instruction_sets.py compares what they print.
#include <cstdio>
#include <cstdlib>
#include <string>

#include "base/error.h"
#include "hull/build/hull_builder.h"
#include "support/degenerate_scenes.h"
#include "support/mesh_checks.h"
#include "support/scenes.h"

namespace polyhull::test {
namespace {

void print(const HullScene& scene, const HullOptions& options) {
  static HullBuilder builder;
  try {
    const Hull& hull = builder.build(scene.views(), options);
    const MeshReport mesh = check_mesh(hull);
    std::printf("%s;%016llx;%s;%zu;%zu;%.6e\n", scene.name.c_str(),
                static_cast<unsigned long long>(fingerprint(hull)),
                mesh.sound() ? "sound" : mesh.describe().c_str(), mesh.vertices, mesh.triangles,
                mesh.volume);
  } catch (const Error& error) {
    std::printf("%s;refused;%s\n", scene.name.c_str(), error.what());
  }
}

void print_in_bounds(const HullScene& scene) {
  HullOptions options;
  options.bounds = scene.rig.bounds;
  print(scene, options);
  options.unseen = Unseen::keep;
  print(scene, options);
}

}  // namespace
}  // namespace polyhull::test

/// The number of random rigs is the only argument.
int main(int argc, char** argv) {
  using namespace polyhull::test;
  const std::uint64_t count = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 60;
#ifdef __FMA__
  std::printf("compiled for fused multiply-add\n");
#else
  std::printf("compiled for the baseline\n");
#endif
  print(figure_scene(4, 8), {});
  print(figure_scene(9, 12, 0.7), {});
  print(knot_scene(5, 12), {});
  polyhull::HullOptions simplified;
  simplified.max_deviation = 1e-3;
  print(figure_scene(5, 10), simplified);
  for (const DegenerateScene& degenerate : degenerate_scenes()) print_in_bounds(degenerate.scene);
  for (std::uint64_t seed = 0; seed < count; ++seed) print_in_bounds(random_scene(seed));
  for (std::uint64_t seed = 0; seed < count; ++seed) print_in_bounds(wild_scene(seed));
}
