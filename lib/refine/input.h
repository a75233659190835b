// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What HullRefiner refuses.
#pragma once

#include <span>
#include <vector>

#include "refine/field/frame.h"
#include "refine/refine.h"

namespace polyhull::refine {

/// Throws Error (bad_input) for what refine() says is none.
void check_input(std::span<const CameraContours> views, double metres_per_unit,
                 const RefineSettings& settings, std::span<const ViewPixels> pictures);

/// Throws Error (unsupported), with the cell that would do, where the grids of \p boxes (cells), each
/// \p margin cells larger either way, would have too many nodes. \p cell: metres.
void check_size(const std::vector<Box>& boxes, int margin, double cell);

}  // namespace polyhull::refine
