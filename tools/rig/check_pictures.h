// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Whether a rig and pictures of the same instant fit together.
#pragma once

#include <string>
#include <vector>

#include "base/rings.h"
#include "rig/check.h"

namespace polyhull {

/// One camera's picture of the subject.
struct CameraPictureRings {
  std::size_t camera = 0;  ///< its number in the rig
  Rings rings;             ///< the silhouette in pixels of the picture, distortion and all
};

/// What the silhouettes say of each other and of \p rig: per camera the part that the hull of the
/// others does not explain and, where it is more than keying can be blamed for, the likeliest of
/// these reasons, each tried out: two pictures exchanged, one picture mirrored or on its head,
/// bounds that the subject is not in, all poses in another form than x_cam = R x + t (transposed,
/// inverted, OpenGL's axes, another order of quaternions), one camera that contradicts the others.
/// Throws Error for fewer than two pictures.
///
/// A wrong unit of the whole rig makes no difference to the pictures (all lengths grow alike); the
/// size of the hull of all of them tells (hull/subject_size.h).
RigReport examine_pictures(const Rig& rig, const std::vector<CameraPictureRings>& pictures);

}  // namespace polyhull
