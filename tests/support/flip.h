// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// FLIP, how different two pictures look when one takes the other's place (Andersson, Nilsson,
/// Akenine-Moeller, Oskarsson, Astroem and Fairchild 2020, "FLIP: A Difference Evaluator for
/// Alternating Images"), for low dynamic range.
///
/// Colours are blurred by what the eye resolves (contrast sensitivity, one filter for each of the
/// opponent channels Y, Cx, Cz) and compared as HyAB distance in Hunt-adjusted L*a*b*; edges and
/// points are found by derivatives of Gaussians on Y. Per pixel, with both differences in 0..1:
///   flip = colour ^ (1 - feature)
#pragma once

#include "base/picture.h"

namespace polyhull::synthetic {

/// Seen 0.7 m from a screen 0.7 m wide with 3840 pixels.
inline constexpr double flip_pixels_per_degree = 67.02;

/// The mean of FLIP over two sRGB pictures of one size, 0 (the same) to 1.
double mean_flip(const Picture& reference, const Picture& shown,
                 double pixels_per_degree = flip_pixels_per_degree);

}  // namespace polyhull::synthetic
