// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A colour decision on a subject, by the definition of the American Society of Cinematographers (ASC
/// Color Decision List, release 1.2, 2009), on linear light:
///   v = clamp(slope * in + offset) ^ power            by channel
///   out = clamp(y + saturation * (v - y)),  y = 0.2126 v_r + 0.7152 v_g + 0.0722 v_b
/// clamp() to 0..1. Slopes are gains, of one channel against another the white balance, offsets lift the
/// blacks, and powers are the inverse of gammas.
#pragma once

#include "base/vector.h"

namespace polyhull {

struct Grade {
  Vec3f slope{1.0f};   ///< 0 and up
  Vec3f offset{0.0f};  ///< of white
  Vec3f power{1.0f};   ///< above 0
  float saturation = 1.0f;
  bool operator==(const Grade&) const = default;
  /// Whether it changes nothing.
  bool neutral() const { return *this == Grade{}; }
};

/// What \p linear becomes: picture values, 1 is white.
Vec3f graded(const Grade& grade, const Vec3f& linear);

}  // namespace polyhull
