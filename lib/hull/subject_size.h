// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How large a hull is in metres, and whether anything on a stage is so large.
///
/// Lengths of a rig all grow alike with its unit, so silhouettes agree whatever the unit, and only a
/// size tells that it is wrong. What is small may be a ball, a hand, or a person of whom little is
/// in all pictures yet, so small sizes are told by how far the cameras stand from the subject; large
/// ones by the height of what hangs together, which no group of people adds to.
#pragma once

#include <span>
#include <string>

#include "hull/hull.h"

namespace polyhull {

/// Cameras nearer to the middle of their stage than this, or farther, are not of a stage, metres.
inline constexpr double nearest_stage = 0.05, farthest_stage = 100.0;

/// Of a hull, in metres.
struct SubjectSize {
  bool known = false;     ///< false: the hull is empty, or it never closes
  double height = 0.0;    ///< along `up`
  double part = 0.0;      ///< height of its highest part that hangs together
  double extent = 0.0;    ///< greatest extent of such a part along an axis of the world
  double distance = 0.0;  ///< of the cameras from its middle, the median
};

/// \p centres: of the cameras, world units. \p bounded: whether the hull was built within bounds;
/// without them one that reaches the limits of hull/hull.h is of no known size.
SubjectSize subject_size(const Hull& hull, std::span<const Vec3> centres, const Vec3& up,
                         double metres_per_unit, bool bounded);

/// Whether \p size is one that no subject has: cameras nearer than nearest_stage or farther than
/// farthest_stage, or a part more than 5 m high, or 10 m in extent. A unit that is wrong by a
/// factor of three, or ten downwards, may remain below that.
bool is_implausible(const SubjectSize& size);

/// A sentence on an implausible \p size where the rig's unit is \p unit: numbers, the likeliest
/// unit, what to do.
std::string about_size(const SubjectSize& size, const std::string& unit);

}  // namespace polyhull
