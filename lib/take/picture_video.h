// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A camera's pictures as VP8, with loss: regions of interest that wander lie at their place in a
/// canvas that is somewhat larger, so that each frame is told by the one before. Colours are
/// halved both ways (4:2:0, BT.601 over the full range); the matte is not the video's.
///
/// VP8 because it says its size in key frames only, so that no damaged frame can ask for more
/// memory, and is as small as newer ones where the time is that of live pictures
/// (docs/benchmarks-network.md).
#pragma once

#include <cstdint>
#include <memory>

#include "take/packed_layout.h"

namespace polyhull {

/// For one camera, and one thread at a time.
class VideoEncoder {
 public:
  VideoEncoder();
  ~VideoEncoder();
  VideoEncoder(VideoEncoder&&) noexcept;
  VideoEncoder& operator=(VideoEncoder&&) noexcept;

  /// The next frame stands alone.
  void begin_anew();
  /// Encodes RGBA \p pixels and makes \p region one of video. False: it is too large for VP8, and
  /// stays as it is. Throws Error (io) where libvpx fails.
  bool encode(Region& region, const std::uint8_t* pixels, int quantizer);
  Bytes frame() const;   ///< that encode() made; lasts until the next
  double error() const;  ///< of that, the sum of the colours' squared errors

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// For one camera, and one thread at a time.
class VideoDecoder {
 public:
  VideoDecoder();
  ~VideoDecoder();
  VideoDecoder(VideoDecoder&&) noexcept;
  VideoDecoder& operator=(VideoDecoder&&) noexcept;

  /// The next frame has to stand alone.
  void begin_anew();
  /// Puts the colours of \p frame, which may come from anywhere, into RGBA \p pixels of \p region.
  /// Throws Error (bad_input).
  void decode(const Region& region, Bytes frame, std::uint8_t* pixels);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace polyhull
