// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The connected components of the solid f > 0, and which of them no silhouette needs.
///
/// Where silhouettes contradict each other by a pixel or two, a ray touches the body nowhere exactly,
/// but some thin fin of the hull that stands off it, and the fit there makes a crumb. A component is
/// needed where some rays touch it that pass by all others that are needed, farther than outlines are
/// sure, and where it covers pixels of the silhouette: a ball that was thrown, a hand whose arm is hidden.
#pragma once

#include <span>

#include "refine/pieces/runs.h"

namespace polyhull::refine {

/// Puts the nodes of components that no ray needs outside of the surface; the largest component
/// stays. \p runs of \p fine, each level's, at 0, and \p rays with their rims there. A ray passes a
/// component by where no node of it is within \p unsure of the ray; one covers it that the ray
/// passes through when it is moved by \p inwards into its silhouette. Returns how many were dropped.
std::size_t drop_unneeded_components(std::span<Level> fine, std::vector<LevelRuns> runs,
                                     const ContactRays& rays, float unsure, float inwards,
                                     int threads);

/// Whether a ray touches the surface at \p point that passes it nowhere else: where the ray is farther
/// than twice \p unsure from its rim, no node inside is within \p unsure. \p runs of \p fine, each
/// level's, at 0.
bool is_needed(const Vec3f& point, std::span<const Level> fine, std::span<const LevelRuns> runs,
               const ContactRays& rays, float unsure);

}  // namespace polyhull::refine
