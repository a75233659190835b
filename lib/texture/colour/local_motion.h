// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How the parts of a coloured surface move from one instant to the next.
///
/// Every point p with colour c that is seen gives linear equations for a small motion (turn, shift) of
/// what it belongs to: it is to lie on the tangent plane of the surface next to it, and the picture
/// that sees it best is to show c there (coloured iterative closest points, Park, Zhou and Koltun
/// 2017; Huber's weights). Points are gathered into nodes, linked where their points touch, and each
/// node n has a rigid motion M_n of its own: it solves
///   sum_m exp(-(d_nm / s)^2) E_m(x) + P(x)
/// with the equations E_m of the nodes at a distance d_nm along the links, and P, which holds it
/// to what it had before: all as one body first, then with less and less s. So a limb moves by what is
/// seen of it, and what is not seen of it with it (embedded deformation, Sumner, Schmid and Pauly 2007,
/// with windows instead of one large system).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "texture/colour/coloured_points.h"
#include "texture/eye.h"

namespace polyhull {

/// What is seen of a surface now.
struct SeenSurface {
  ColouredPoints points;
  std::vector<std::uint8_t> views;  ///< of each point the one that sees it best
  std::span<const Eye> eyes;        ///< the views
  Vec3f shift{0.0f};                ///< from what the eyes take to the points
  float pixel = 1.0f;               ///< the size of the views' pixels there

  /// What view \p k shows at \p place; none where something hides it.
  std::optional<Vec3f> shown(std::size_t k, const Vec3f& place) const {
    Vec2f at;
    if (!(eyes[k].look(place - shift, at) > 0.0f)) return std::nullopt;
    return eyes[k].colour_between(at);
  }
};

/// Moves \p points, of which those with \p seen were seen at the instant before, to where they are
/// now. Parts that moved by more than some eight pixels against all others are lost. The same for
/// any number of \p threads.
void carry(ColouredPoints& points, std::span<const std::uint8_t> seen, const SeenSurface& now,
           int threads);

}  // namespace polyhull
