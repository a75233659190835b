// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A view's pixels made ready to be sampled as skin.
#pragma once

#include <cstdint>
#include <vector>

#include "mesh/view.h"

namespace polyhull {

/// The region of interest with a border of one repeated pixel all around, so (width + 2) x (height
/// + 2) RGBA pixels. Where the matte is not fully in the foreground (its soft edge, and a few
/// pixels beyond) the colour is continued from the nearest fully covered pixels, so that no
/// background colour is sampled at the silhouette's rim. \p pixels keeps its memory between calls.
void prepare_view_picture(const View& view, std::vector<std::uint32_t>& pixels);

}  // namespace polyhull
