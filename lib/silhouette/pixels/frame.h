// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A camera's frame as it lies in memory: borrowed planes with their format and colorimetry.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/vector.h"

namespace polyhull {

/// Layouts that can be keyed without a conversion in front. Names as in GStreamer.
enum class FrameFormat : std::uint8_t {
  rgbx,
  bgrx,
  rgba,
  bgra,
  rgb,
  bgr,
  gray8,
  i420,
  nv12,
  yuy2,
  uyvy,
  i420_10le,  ///< ten bits in the low bits of little-endian 16-bit words
  v210,       ///< 4:2:2, three samples of ten bits in each little-endian 32-bit word
  bayer8,     ///< a colour sensor's mosaic: one sample per pixel, as BayerOrder says
  bayer10le,  ///< the same with ten bits in the low bits of little-endian 16-bit words
  bayer12le,  ///< with twelve
  described,  ///< any other layout of three components: FrameView::samples says where they lie
};

/// Where the samples of a described frame lie: those of one kind at equal distances in a row.
struct SampleLayout {
  struct Component {
    int plane = 0;
    int offset = 0;  ///< bytes from the row's begin to the first sample
    int step = 1;    ///< bytes from one to the next
    bool operator==(const Component&) const = default;
  };
  std::array<Component, 3> components{};  ///< Y', Cb, Cr; or R', G', B'
  bool rgb = false;                       ///< which of the two
  int bits = 8;                ///< of a sample; above eight they lie in little-endian 16-bit words,
  int shift = 0;               ///< this many bits from the word's low end
  bool halved_across = false;  ///< a chroma sample for two columns (4:2:2, 4:2:0)
  bool halved_down = false;    ///< a chroma sample for two rows (4:2:0)
  bool operator==(const SampleLayout&) const = default;
};

/// Colours of the first two pixels of the first two rows of a colour sensor's mosaic.
enum class BayerOrder : std::uint8_t { bggr, gbrg, grbg, rggb };

/// How Y'CbCr becomes R'G'B' (ignored for RGB formats).
enum class ColourMatrix : std::uint8_t { bt601, bt709, bt2020 };

/// Where 4:2:0 and 4:2:2 chroma samples lie between the luma samples.
enum class ChromaSite : std::uint8_t {
  left,  ///< horizontally on even columns, vertically (4:2:0) half way between rows: MPEG-2, H.264
  centre,    ///< half way between columns (and rows): JPEG, MPEG-1
  top_left,  ///< on even columns and even rows: BT.2020
  top,       ///< half way between columns, on even rows
};

/// One frame, borrowed. Formats that hold all of a pixel in one place use planes[0] only; NV12 uses
/// planes[1] for CbCr; I420 and I420_10LE use planes[1] for Cb and planes[2] for Cr. Strides are in
/// bytes and may be negative. Any alpha in RGBA and BGRA is ignored by the keyer.
struct FrameView {
  FrameFormat format = FrameFormat::rgba;
  int width = 0;
  int height = 0;
  std::array<const std::uint8_t*, 3> planes{};
  std::array<std::ptrdiff_t, 3> strides{};
  ColourMatrix matrix = ColourMatrix::bt601;
  bool full_range = false;  ///< 0..255 instead of 16..235 / 16..240; RGB is taken as it is
  ChromaSite site = ChromaSite::left;
  BayerOrder bayer = BayerOrder::bggr;  ///< of the formats that are a mosaic
  SampleLayout samples{};               ///< of FrameFormat::described

  const std::uint8_t* row(int plane, int y) const { return planes[plane] + strides[plane] * y; }
};

/// True for the formats that carry luma and chroma.
bool is_yuv(FrameFormat format);

/// True for the formats with a chroma sample of its own for every second pixel of every row
/// (4:2:2).
bool is_422(FrameFormat format);

/// True for the formats whose samples have ten bits instead of eight.
bool is_ten_bit(FrameFormat format);

/// True where a frame carries luma and chroma, described or not.
bool is_yuv(const FrameView& frame);

/// Whether a frame's samples have more than eight bits, and whether it has half as many chroma
/// samples as pixels across and down, described or not.
bool is_deep(const FrameView& frame);
bool halved_across(const FrameView& frame);
bool halved_down(const FrameView& frame);

/// Bits of a sample of the formats that are a colour sensor's mosaic; 0 of all others.
int bayer_bits(FrameFormat format);

/// The format's name as GStreamer writes it ("BGRx").
const char* name_of(FrameFormat format);

/// Throws Error (bad_input) when a plane is missing, width or height is not from 1 to 32767, or the
/// stride of several rows is shorter than a row.
void check_frame(const FrameView& frame);

/// Writes pixels [x0, x1) of row \p y as R, G, B, 255 bytes, chroma interpolated between its
/// samples, and colours of a mosaic between theirs (bilinear). \p rgba points at the pixel x0.
void convert_row(const FrameView& frame, int y, int x0, int x1, std::uint8_t* rgba);

/// Whether equal bytes are equal colours: format, size, colorimetry, chroma site and mosaic agree.
bool same_layout(const FrameView& a, const FrameView& b);

/// Whether the layouts are the same, and so is every byte that the pixels of \p region depend on,
/// chroma beside it included. Reads both frames.
bool same_pixels(const FrameView& a, const FrameView& b, const Rectangle& region);

/// A hash (FNV-1a on words) of 16 rows of the first plane inside \p region, which must lie in the
/// frame: frames with different hashes differ.
std::uint64_t hash_of_some_rows(const FrameView& frame, const Rectangle& region);

/// A frame's pixels inside a region, kept.
class FrameCopy {
 public:
  /// Copies what the pixels of \p region depend on, chroma beside it included.
  void assign(const FrameView& frame, const Rectangle& region);
  /// Of the whole frame's size; only the region's bytes are defined.
  const FrameView& view() const { return view_; }

 private:
  FrameView view_;
  std::array<std::vector<std::uint8_t>, 3> planes_;
};

}  // namespace polyhull
