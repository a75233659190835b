// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The figure's surface at rest, and how its bones hold it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/vector.h"
#include "studio/figure/implicit_skin.h"

namespace polyhull {

/// All arrays but the triangles have one entry per vertex.
struct FigureSkin {
  static constexpr int influences = 4;
  std::vector<Vec3f> positions;
  std::vector<Vec3f> normals;
  std::vector<float> openness;  ///< share of the light from around that no other part holds back
  std::vector<std::array<std::uint8_t, influences>> bones;
  std::vector<std::array<float, influences>> weights;  ///< of those bones, falling; their sum is 1
  std::vector<std::uint32_t> triangles;                ///< three vertices each
};

/// The bodies of the figure's skin at rest.
std::vector<SkinBody> figure_bodies();

/// The skin around the bodies; \p step is the grid spacing of its polygonisation in metres.
FigureSkin make_figure_skin(float step = 0.019f);

/// The same with the default step, made when polyhull was built (make_figure_skin takes a second of
/// processor time), by figure_skin_writer.cpp.
FigureSkin stored_figure_skin();

}  // namespace polyhull
