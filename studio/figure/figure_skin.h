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

/// Nearly the same surface with no more than \p triangles (coarsen.h).
FigureSkin coarser_figure_skin(const FigureSkin& skin, std::size_t triangles);

/// The coarser skins that are stored, and the size of a pixel on the figure, in metres, from which
/// each will do: half of the triangles displace outlines twice as far, which is the same in pixels
/// of twice the size (0.05 px on average).
struct CoarserSkin {
  std::size_t triangles;
  float pixel;
};
inline constexpr std::array<CoarserSkin, 3> coarser_skins = {
    {{16000, 0.002f}, {8000, 0.004f}, {4000, 0.008f}}};

/// Skin 0 is that of the default step, skin n is coarser_skins[n - 1]; made when polyhull was built,
/// by figure_skin_writer.cpp (make_figure_skin takes a second of processor time).
FigureSkin stored_figure_skin(std::size_t index);

}  // namespace polyhull
