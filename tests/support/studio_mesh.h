// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A subject of the studio on its way from the cameras' pictures to a textured hull, and the truth
/// from a viewport, for tests and benchmarks of composites.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/picture.h"
#include "mesh/mesh.h"
#include "rig/rig.h"
#include "silhouette/silhouette.h"
#include "studio/figure/subject.h"

namespace polyhull::test {

/// \p count cameras of 1024 x 768 like those of the built-in rig, evenly around the stage.
Rig ring_rig(int count);

/// The mesh, and the pixels that its views borrow.
struct StudioMesh {
  Mesh mesh;
  std::vector<std::vector<std::uint8_t>> pixels;
};

/// What \p rig's cameras make of \p subject ("figure", "hairy") at \p seconds before an uneven green
/// screen with shadow and sensor noise: keyed, traced, intersected, textured.
StudioMesh studio_mesh(const Rig& rig, const std::string& subject, double seconds,
                       const SilhouetteSettings& settings);

/// What \p viewport sees of \p subject before a background of one sRGB colour: RGBA, alpha the share
/// of each pixel that the subject covers.
Picture studio_truth(const Camera& viewport, const std::string& subject, double seconds,
                     const std::array<std::uint8_t, 3>& background);

/// How a picture differs from the truth in the pixels within 8 of the outline, the border of the
/// pixels that the subject covers by half or more; levels, over red, green and blue.
struct EdgeError {
  double mean = 0.0, rms = 0.0;
  std::size_t pixels = 0;
};
EdgeError edge_error(const Picture& picture, const Picture& truth);

}  // namespace polyhull::test
