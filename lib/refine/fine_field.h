// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The field near the surface on a grid twice as fine, fitted to the rims and cut at the hull.
#pragma once

#include <cstdint>
#include <vector>

#include "refine/contact_rays.h"
#include "refine/hull_distance.h"

namespace polyhull::refine {

/// Makes \p fine from \p coarse: f by cubic B-splines at half its cell (even nodes (1, 6, 1) / 8, odd
/// ones (4, 4) / 8; it smooths as well) where it may be inside, else `outside`; and as its H the
/// exact one where the coarse H says that the hull is near, else what is certainly above f.
void make_fine(const Level& coarse, const HullDistance& hull, Level& fine, int threads);

/// f <- min(f, H), and `outside` at the grid's border.
void cut_at_hull(Level& fine, int threads);

/// What fit_to_rims() works with; kept from call to call.
struct FitMemory {
  std::vector<float> sums, weights;
  std::vector<std::vector<std::uint32_t>> rays_of_slab;
};

/// Moves f at the nodes within \p radius of rims so that rims get the value \p target: each
/// rim asks the nodes around it whose gradient runs along its normal, the nearer the more; a node
/// does the mean of what it is asked.
void fit_to_rims(Level& fine, const ContactRays& rays, std::uint32_t part, float radius,
                 float target, FitMemory& memory, int threads);

}  // namespace polyhull::refine
