// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How different two colours look: CIEDE2000.
#pragma once

#include "base/vector.h"

namespace polyhull {

/// CIE L*a*b* (white D65, 2 degrees) of \p linear, linear light with the primaries of sRGB and
/// BT.709, 1 = white.
Vec3 lab_of_linear(const Vec3& linear);

/// CIEDE2000 (k_L = k_C = k_H = 1) of two L*a*b* colours; 1 is about what an eye can just tell.
/// After Sharma, Wu and Dalal, "The CIEDE2000 color-difference formula: implementation notes,
/// supplementary test data, and mathematical observations", Color Research & Application 30 (2005).
double colour_difference(const Vec3& a, const Vec3& b);

}  // namespace polyhull
