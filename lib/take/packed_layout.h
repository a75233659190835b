// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How a packed packet of a take lies in its bytes (packing.h), little-endian:
///
///     0    8  the id of the packet before, that has to be unpacked first; 0: it stands alone
///     8    4  version: 1
///     12   4  bytes of the packet, unpacked
///     16   4  bytes of the head, unpacked
///     20   4  of it, packed
///     24   4  bytes of the pictures, unpacked
///     28   4  of them, packed
///     32   …  the head, by zstd; where there is a packet before, with its head as the prefix
///     …    …  the pictures, by zstd
///     …    …  the videos' frames, one after the other
///
/// The head is the number of regions (4 bytes), the regions as below, what of the packet is in no
/// region, and the regions of numbers, filtered (number_filter.h). The pictures are what of them
/// neighbours and the packet before do not tell (picture_filter.h).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace polyhull {

using Bytes = std::span<const std::uint8_t>;

/// What a run of a packet's bytes is.
enum class RegionKind : std::uint32_t {
  numbers,  ///< a list of whole numbers or floats
  grid,     ///< floats that are whole multiples of `step`
  picture,  ///< rows of pixels without gaps
  video,    ///< the same, whose colours are a frame of VP8; its matte is as a picture's
};

/// One run, as in the bytes.
struct Region {
  RegionKind kind = RegionKind::numbers;
  std::uint32_t offset = 0, size = 0;                 ///< in the packet
  std::uint32_t element = 1;                          ///< bytes of a number, or of a pixel (1, 4)
  std::uint32_t components = 1;                       ///< numbers of one item
  std::uint32_t x = 0, y = 0, width = 0, height = 0;  ///< in the camera's frame, pixels
  std::uint32_t canvas_x = 0, canvas_y = 0;           ///< of the video, in the camera's frame
  std::uint32_t canvas_width = 0, canvas_height = 0;  ///< of the video, pixels
  std::uint32_t video_size = 0;                       ///< bytes of its frame
  double step = 0;                                    ///< of a grid

  bool pictured() const { return kind == RegionKind::picture || kind == RegionKind::video; }
};
static_assert(sizeof(Region) == 64);

struct PackedPrefix {
  std::uint64_t before = 0;
  std::uint32_t version = 1;
  std::uint32_t size = 0;
  std::uint32_t head = 0, head_packed = 0;
  std::uint32_t pictures = 0, pictures_packed = 0;
};
static_assert(sizeof(PackedPrefix) == 32);

/// The largest packet that is packed or unpacked, bytes: a few of a file's must not take all memory.
inline constexpr std::size_t most_packet_bytes = std::size_t{256} << 20;
inline constexpr std::size_t most_regions = 1024;

/// Throws Error (bad_input): too short, another version, sizes that do not add up or are too large.
PackedPrefix read_packed_prefix(Bytes block);

/// The regions at the front of \p head, of a packet of \p size bytes. Throws Error (bad_input) where
/// one is not within the packet, overlaps the one before, or contradicts itself.
std::vector<Region> read_regions(Bytes head, std::size_t size);

/// Whether the region lies in its canvas, and that is one of VP8 and not much larger than the region:
/// up to four times and 256 x 256 pixels, so that a few bytes cannot ask for much memory.
bool fits_video(const Region& region);

/// Bytes of a head with these regions, and of what their pictures are filtered to.
std::size_t head_size(std::span<const Region> regions, std::size_t packet);
std::size_t pictures_size(std::span<const Region> regions);

/// Throws Error (bad_input) that says \p what is wrong of a packed packet.
[[noreturn]] void refuse_packed(const char* what);

}  // namespace polyhull
