// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How clear a matte is, as a number to adjust a key by.
///
/// A good matte is black (0 to 5) and white (250 to 255), with what lies in between along its edge
/// alone. A pixel in between is doubtful where no edge is: no black or no white within its cell of
/// 8 by 8 pixels and the eight around. Hair that is wider than that counts as doubtful, too, and a
/// matte that lost the subject, or kept the screen, as clear: whether it is right only eyes can tell.
#pragma once

#include "base/vector.h"
#include "silhouette/pixels/matte.h"

namespace polyhull {

/// Shares are of the region's pixels, 0..1.
struct KeyScore {
  double subject = 0.0;           ///< pixels that are more than half foreground
  double doubtful_subject = 0.0;  ///< of these, the doubtful ones: holes, a face that is not solid
  double doubtful_screen = 0.0;   ///< of the others: a screen that is not clean

  /// 100 less the doubtful pixels as a percentage of the subject's (of a hundredth of the region at
  /// least), 0..100.
  double score() const;
};

/// The score of \p matte in \p region, which lies within it (Keyer::active()).
KeyScore score_of(const Matte& matte, const Rectangle& region);

}  // namespace polyhull
