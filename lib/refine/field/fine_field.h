// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The field near the surface on a grid twice as fine, fitted to the rims and cut at the hull.
#pragma once

#include <cstdint>
#include <vector>

#include "base/memory/sparse_array.h"
#include "refine/field/contact_rays.h"
#include "refine/field/hull_distance.h"

namespace polyhull::refine {

/// By how much the coarse H may be wrong near the hull, and fits may raise f.
inline constexpr float hull_near = 0.6f;
/// Level::hull where H is certainly above f, by \p hull_near where f is below 0.
inline constexpr float hull_far = 1e6f;

/// Makes \p fine from \p coarse: f by cubic B-splines at half its cell (even nodes (1, 6, 1) / 8, odd
/// ones (4, 4) / 8; it smooths as well) where it may be inside, else `outside`; and as its H the
/// exact one where the coarse H says that the hull is near, else hull_far.
void make_fine(const Level& coarse, const HullDistance& hull, Level& fine, int threads);

/// f <- min(f, H), and `outside` at the grid's border.
void cut_at_hull(Level& fine, int threads);

/// What fit_to_rims() works with; kept from call to call.
struct FitMemory {
  SparseArray<float> asks;    ///< of nodes (AskedSlab); 0 between calls
  std::vector<Extent> asked;  ///< which nodes of each row
  std::vector<std::vector<AskingRim>> rims_of_slab;
};

/// How rims ask.
struct RimFit {
  float radius = 0.5f;
  float target = 0.0f;     ///< f that rims are to have
  std::size_t stride = 1;  ///< only each so many-th ray asks
};

/// Moves f at the nodes around rims so that rims get the value that they are to have: each rim asks
/// the nodes within the radius whose gradient runs along its normal, the nearer the more; a node
/// does the mean of what it is asked, and stays at H at most.
void fit_to_rims(Level& fine, const ContactRays& rays, std::uint32_t part, const RimFit& fit,
                 FitMemory& memory, int threads);

}  // namespace polyhull::refine
