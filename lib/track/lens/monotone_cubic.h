// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A curve through points that is monotone wherever they are: Fritsch and Butland, "A method for
/// constructing local monotone piecewise cubic interpolants", SIAM J. Sci. Stat. Comput. 5, 1984, with
/// a parabola's slope at the ends. Through points on a straight line it is that line. Its harmonic
/// means suit curves that grow by a factor, as a zoom's focal length does.
#pragma once

#include <vector>

namespace polyhull {

/// The value at \p x of the curve through the points (\p xs, \p ys), of which there is at least one and
/// whose xs grow; beyond them that of the last.
double monotone_cubic(const std::vector<double>& xs, const std::vector<double>& ys, double x);

}  // namespace polyhull
