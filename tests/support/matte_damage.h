// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Mattes of figures and what bad keying does to them: holes, bites at the outline, specks.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "base/rings.h"
#include "rig/rig.h"
#include "scenes.h"
#include "silhouette/pixels/matte.h"
#include "studio/figure/subject.h"

namespace polyhull::test {

enum class Damage {
  hole,   ///< within the outline, at least 3 px from it
  bite,   ///< across the outline, its middle inside
  speck,  ///< background, at least 3 px from the outline
};

/// The true mattes of \p subject in all cameras of \p rig at \p time.
std::vector<Matte> mattes_of(const std::shared_ptr<const Subject>& subject, const Rig& rig,
                             double time);

/// The matte whose outline is \p rings.
Matte matte_of(const Rings& rings, int width, int height);

/// Puts a wobbly blob of \p diameter px somewhere into \p matte that \p kind allows; false: there
/// was no place. Specks lie within \p diameter and 60 px of the subject's box.
bool damage(Matte& matte, Damage kind, double diameter, Dice& dice);

/// The walking figure of figure.h on the floor at y = 0.
Rings standing_silhouette(const Camera& camera, double time);

/// Area of the region that the rings enclose, px².
double total_area(const Rings& rings);

/// The contours as hullbuild would get them: tolerance half a pixel, no ring dropped for its size.
Rings contours_of(const Matte& matte);

/// \p count cameras of 1024x768, 3 m from the middle of a person on a floor at y = 0, all around at
/// heights between .6 and 2.4 m; with \p seed above 0 angles and heights are random.
Rig ring_around_person(int count, std::uint64_t seed = 0);

}  // namespace polyhull::test
