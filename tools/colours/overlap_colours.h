// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// polyhull-rig colours --overlaps: gains by which cameras agree that see the same places of a subject.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/picture.h"
#include "base/rings.h"
#include "rig/rig.h"

namespace polyhull {

/// What one camera sees of the subject.
struct SubjectPicture {
  std::size_t camera = 0;  ///< its number in the rig
  Picture picture;         ///< 4 channels, the last the matte
  Rings contours;          ///< of the matte, real pixels
};

/// Multiplies the matrices (Camera::colour) of \p rig's cameras that have one of \p pictures, all of
/// one instant, by the gains that ColourBalance finds on the refined hull of the subject; what all
/// cameras have in common stays. Returns a table, in text, of the gains and, for each two cameras that
/// see the same places, the mean difference there as CIEDE2000 of a mid grey, before and after. Throws
/// Error for fewer than two pictures, silhouettes without a hull, and cameras none of which sees what
/// another sees.
std::string match_overlaps(Rig& rig, std::span<const SubjectPicture> pictures);

/// The same of files CAMERA=FILE: pictures (PNG) with the matte in their alpha. Throws Error for those
/// without.
std::string match_overlaps(Rig& rig, const std::vector<std::string>& files);

}  // namespace polyhull
