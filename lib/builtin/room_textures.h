// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The built-in room's pictures, computed: the same on every machine up to rounding. Each takes the
/// picture as it may have been computed before, and returns that if some of its pixels, computed
/// anew, are the same: these are one in a hundred, so this costs a hundredth.
#pragma once

#include "base/picture.h"

namespace polyhull {

/// Dark polished stone, \p size pixels a side: two by two slabs with veins and joints; repeats
/// seamlessly.
Picture stone_texture(int size, Picture kept = {});

/// Wood, \p size pixels a side, with grain along the first texture coordinate.
Picture wood_texture(int size, Picture kept = {});

/// An abstract landscape for the wall: hills under a low sun.
Picture painting_texture(int width, int height, Picture kept = {});

/// A print on warm white paper: overlapping discs and arcs; \p number chooses which.
Picture print_texture(int width, int height, unsigned number, Picture kept = {});

/// A woven hanging: bands of stripes, lozenges and steps in earth colours.
Picture tapestry_texture(int width, int height, Picture kept = {});

}  // namespace polyhull
