// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What LightCache asks of its nodes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "raytrace/float4.h"
#include "raytrace/surface_grid.h"
#include "raytrace/traced_scene.h"

namespace polyhull {

inline constexpr std::uint32_t bounce_seed = 0xa54ff53aU;  // of directions of bounced light

/// Whether a node lies inside a closed body: most of what it sees are backs.
bool inside_a_body(const TracedScene& scene, const SurfaceGrid::Node& node);

/// The value at a hit of \p values at the grid's nodes.
Float4 interpolate(const SurfaceGrid& grid, const std::vector<Float4>& values, const RayHit& hit);

/// The nodes at a block's corners, row by row.
std::array<std::uint32_t, 4> corners(const SurfaceGrid::Block& block);

/// The value between a block's corners, \p x and \p y from 0 to 1.
Float4 between(const std::vector<Float4>& values, const SurfaceGrid::Block& block, float x,
               float y);

}  // namespace polyhull
