// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A frame number that can be read in the picture itself: a label on the subject's chest.
///
/// Time stamps say what elements believe; the label says which instant a picture shows. It is a
/// square of 7x7 cells: a rim of magenta, which no coloured screen contains, and in it 5x5 cells,
/// black or white: row by row the number's 16 bits, 8 bits of check, and one that is white. It lies
/// in the middle of the subject and is foreground, so that it comes through keying, views and
/// textures.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "base/vector.h"

namespace polyhull {

/// Draws the label of \p number modulo 65536 into RGBA or BGRA rows of \p stride bytes, \p width x
/// \p height pixels, in the middle of \p subject (pixels). Alpha stays as it is outside the label
/// and becomes 255 in it. Draws nothing where the subject is less than 24 pixels high.
void draw_stamp(std::uint16_t number, const Rectangle& subject, std::uint8_t* pixels,
                std::ptrdiff_t stride, int width, int height);

/// The number on the label in RGBA or BGRA rows of \p stride bytes; none: no label, or not to be
/// read.
std::optional<std::uint16_t> read_stamp(const std::uint8_t* pixels, std::ptrdiff_t stride,
                                        int width, int height);

}  // namespace polyhull
