// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Epipolar tangency: whether two cameras agree about the planes through both that touch the subject.
///
/// A plane through the centres of cameras a and b that touches the subject touches it in a frontier
/// point, whose pictures lie on both silhouettes' outlines (Cipolla, Åström and Giblin 1995, "Motion
/// from the frontier of curved surfaces"; Wong and Cipolla 2004, "Reconstruction of sculpture from
/// its profiles with unknown camera positions", section 3). With the unit vector e from one centre
/// to the other and u, v, e orthonormal, the ray d of a pixel lies in the plane of the angle
///
///     theta(d) = atan2(d·v, d·u),
///
/// so the least theta over the outline of a is that over the outline of b, and so is the greatest.
/// The plane's normal n = cos(theta) v - sin(theta) u is seen as the epipolar line L = K^-T R n, and
/// a pixel beside the line by one pixel has another theta by
///
///     s = |L_xy| / |(e x n)·d|   radians.
///
/// Two outlines right to a pixel each differ by the angle of sqrt(s_a^2 + s_b^2), and the error is
/// told in such pixels: sqrt(2) (theta_a - theta_b) / sqrt(s_a^2 + s_b^2). Noise of outlines, which
/// moves the extremes of both outwards, has it about 0 in the mean; a camera that is off has not.
///
/// The error does not see movements along epipolar lines: of two cameras at one height looking
/// ahead, a turn to the side. Other pairs do.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "hull/hull.h"

namespace polyhull {

/// Two cameras' pictures of one frontier point.
struct Tangency {
  std::size_t first = 0, second = 0;  ///< the views, first < second
  bool greatest = false;              ///< of the two frontier points the one with the greater theta
  Vec2 at_first{0.0}, at_second{0.0};  ///< pinhole pixels
  double error = 0.0;                  ///< pixels, of either sign
};

/// The frontier points of \p silhouettes (pinhole pixels): at most two for each pair, at most \p
/// most_pairs pairs, others each \p round. Left out are outlines that leave the picture there, and
/// pairs that see each other too near to the subject, or from one place.
std::vector<Tangency> find_tangencies(
    std::span<const Silhouette> silhouettes,
    std::size_t most_pairs = std::numeric_limits<std::size_t>::max(), std::uint32_t round = 0);

/// How far two cameras disagree about both planes.
struct PairTangency {
  std::size_t first = 0, second = 0;  ///< the views
  double error = 0.0;                 ///< px, 0 or more
};

/// For each pair in \p tangencies, which may be of many sets, by first and second: the root mean
/// square of its planes' errors, of which each is the median of all sets'.
std::vector<PairTangency> median_by_pair(std::span<const Tangency> tangencies);

/// The root mean square of the errors of \p pairs that have the view \p view, or of those that do not.
double error_with(std::span<const PairTangency> pairs, std::size_t view);
double error_without(std::span<const PairTangency> pairs, std::size_t view);

/// The view of \p views that \p pairs point at: the root mean square of its pairs is 1 px or more,
/// and three times that of the pairs without it, of several the most times. -1: none, or it cannot be
/// told.
int camera_off(std::span<const PairTangency> pairs, std::size_t views);

/// So many of \p views agree with each other: of those that miss each other by 3 px or more the one
/// with the most such pairs is left out until there are none. Two that \p pairs do not have agree.
std::size_t agreeing_views(std::span<const PairTangency> pairs, std::size_t views);

}  // namespace polyhull
