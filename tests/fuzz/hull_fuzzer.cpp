// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: HullBuilder::build() on any cameras and rings. Whatever comes out must be sound.
#include <cstdio>
#include <cstdlib>

#include "base/error.h"
#include "hull/build/hull_builder.h"
#include "support/mesh_checks.h"
#include "support/scene_from_bytes.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace polyhull;
  const test::ScenePlan plan = test::scene_from_bytes({data, size});
  static HullBuilder builder;  // what one call leaves behind must not harm the next
  try {
    const test::MeshReport report =
        test::check_mesh(builder.build(plan.scene.views(), plan.options));
    if (!report.sound()) {
      std::fprintf(stderr, "%s\n", report.describe().c_str());
      std::abort();
    }
  } catch (const Error&) {
  }
  return 0;
}
