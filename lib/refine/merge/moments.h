// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How flat a piece of surface is.
#pragma once

#include "base/vector.h"

namespace polyhull::refine {

/// By how much the surface in a box may leave its plane, in cells, root mean square.
struct Flatness {
  float anywhere = 0.3f;
  float at_rims = 0.1f;  ///< where an outline is made
};

/// Integrals over a piece of surface, by its loops of crossed edges.
struct Moments {
  float area = 0.0f;
  Vec3f sum{0.0f}, normal{0.0f};  ///< of the place, and of the unit normal
  float squares[6] = {};          ///< of xx, yy, zz, xy, yz, zx

  void add(const Moments& more);
  /// Whether it turns little, and leaves its mean plane by at most \p most, root mean square.
  bool is_flat(float most) const;
};

}  // namespace polyhull::refine
