// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Pixel blocks of views made smaller, for slow wires and long takes.
///
/// Without loss a picture first becomes what its neighbours do not tell: red and blue less green,
/// each channel a plane of its own, each sample less the one to its left (the first of a row less
/// the one above), all modulo 256. What is left is small numbers around 0, which zstd's entropy
/// coder packs into half, and LZ4, which has none, into three quarters; without that step both
/// hardly gain on a camera's noise. With loss the colours become a JPEG, while the matte in alpha
/// stays exact.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "mesh/view.h"

namespace polyhull {

/// As in view.fbs.
enum class PixelCoding : std::uint8_t { raw, lz4, zstd, jpeg };

/// The largest picture that is unpacked, bytes: a few of the wire's must not take all memory.
inline constexpr std::size_t most_decoded_bytes = std::size_t{256} << 20;

/// A picture's shape; rows lie without gaps where it is unpacked.
struct PixelShape {
  int width = 0, height = 0;  ///< of the region of interest, pixels
  int channels = 0;           ///< 4: RGBA, 1: grey
  std::size_t bytes() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
           static_cast<std::size_t>(channels);
  }
};

/// Packs pixels; keeps its memory for the next picture. For one thread at a time.
class PixelEncoder {
 public:
  PixelEncoder();
  ~PixelEncoder();

  /// The block of \p pixels, whose rows are \p stride bytes apart. Lasts until the next call.
  /// \p quality: JPEG's, 1 to 100. Throws Error (bad_input): raw, JPEG of a grey picture, one above
  /// most_decoded_bytes.
  std::span<const std::uint8_t> encode(PixelCoding coding, const PixelShape& shape,
                                       std::span<const std::uint8_t> pixels, int stride,
                                       int quality = 90);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Unpacks pixels. For one thread at a time.
class PixelDecoder {
 public:
  PixelDecoder();
  ~PixelDecoder();

  /// Fills \p pixels, which has shape.bytes(), from \p block. Throws Error (bad_input) for a block
  /// that is not this shape's; what \p pixels holds then is of no use.
  void decode(PixelCoding coding, const PixelShape& shape, std::span<const std::uint8_t> block,
              std::span<std::uint8_t> pixels);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace polyhull
