// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Where the subject stands in a mask file, in whichever convention it was written.
#pragma once

#include <string>

#include "base/picture.h"

namespace polyhull {

struct MaskPicture {
  Picture picture;      ///< one channel, 255 the subject; of a picture to be keyed: R, G, B
  bool to_key = false;  ///< no mask: the subject before a coloured screen
  std::string note;     ///< what its reader should know; empty: nothing
};

/// Reads \p path (PNG or JPEG). The mask is its alpha where that differs from pixel to pixel, else
/// its grey level, the subject bright, both by mask_levels(), or, of a few flat levels as labels
/// have them, whatever is not black; else, in a picture of a few flat
/// colours, whatever differs from the colour that most of its border has, unless that is a green or
/// blue screen's. Any other coloured picture is to be keyed. Throws Error where it cannot be read,
/// and for a mask that covers three quarters of its border and a quarter of the picture: it shows the
/// background, or nothing but the subject.
MaskPicture load_mask_picture(const std::string& path);

}  // namespace polyhull
