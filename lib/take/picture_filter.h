// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What of a picture its neighbours in space and time do not tell, without loss: as in
/// wire/pixel_coding.h red and blue less green, each channel a plane of its own, and each run of 32
/// samples of a row less either their left neighbours or the same pixels of the camera's frame in
/// the packet before, whichever leaves less; all modulo 256. Behind the planes follows, for each run,
/// which (0 left, 1 before).
#pragma once

#include <cstdint>

#include "take/packed_layout.h"

namespace polyhull {

/// A picture of the packet before, of the same pixel format; without pixels: there is none.
struct PictureBefore {
  Region region;
  const std::uint8_t* pixels = nullptr;
};

/// Bytes that the region is filtered to: of a video only the matte counts.
std::size_t filtered_size(const Region& region);

/// Puts filtered_size() bytes to \p out.
void filter_picture(const Region& region, const std::uint8_t* pixels, const PictureBefore& before,
                    std::uint8_t* out);

/// The way back; of a video only the pixels' fourth bytes are written. Throws Error (bad_input)
/// where a run says it was told by a packet that does not have it.
void unfilter_picture(const Region& region, const std::uint8_t* filtered,
                      const PictureBefore& before, std::uint8_t* pixels);

}  // namespace polyhull
