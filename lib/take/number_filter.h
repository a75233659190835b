// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Lists of numbers made easier to pack, without loss: each less the one an item before, modulo its
/// range, sign last (0, -1, 1, -2 … become 0, 1, 2, 3 …), then all lowest bytes, all second bytes …
/// Floats count as the whole numbers that their bits are. On a grid, what multiple of the step each
/// is, in 32 bits, takes the float's place.
#pragma once

#include <cstdint>

#include "take/packed_layout.h"

namespace polyhull {

/// Puts the region's size in bytes to \p out, from the \p numbers of a region of numbers or a grid.
void filter_numbers(const Region& region, const std::uint8_t* numbers, std::uint8_t* out);

/// The way back.
void unfilter_numbers(const Region& region, const std::uint8_t* filtered, std::uint8_t* out);

/// The float that is \p multiple of \p step.
float on_grid(std::int32_t multiple, double step);

/// Moves \p count floats to the nearest multiples of \p step. False, and nothing is changed, where
/// one is too large (2^30 steps) or not finite.
bool round_to_grid(std::uint8_t* floats, std::size_t count, double step);

}  // namespace polyhull
