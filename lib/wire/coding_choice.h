// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which packing brings pictures over a link soonest.
///
/// A picture takes t = pack + bytes / link + unpack. For each coding c the share of the raw bytes that
/// it leaves and its times per raw byte are measured on every fiftieth picture and on the first
/// three, and smoothed; the coding with the least t for the next picture's size is chosen, another
/// one than before only where it spares 5 %, so that two alike do not take turns.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "wire/pixel_coding.h"

namespace polyhull {

/// For one thread at a time.
class CodingChoice {
 public:
  /// What one coding made of one picture.
  struct Trial {
    std::size_t raw_bytes = 0, bytes = 0;
    double pack_ms = 0, unpack_ms = 0;
  };

  /// Whether all codings are to be tried on the next picture, which counts it.
  bool trial_due();
  void note(PixelCoding coding, const Trial& trial);

  /// The best coding for a picture of \p raw_bytes over \p link megabits a second, JPEG only where
  /// \p with_loss. Raw until there was a trial.
  PixelCoding choose(std::size_t raw_bytes, double link, bool with_loss);

  /// How long a picture of \p raw_bytes takes by what is known of \p coding, ms.
  double milliseconds(PixelCoding coding, std::size_t raw_bytes, double link) const;

 private:
  struct Known {
    bool tried = false;
    double share = 1;             // of the raw bytes
    double pack = 0, unpack = 0;  // ms per raw byte
  };
  std::array<Known, 4> known_{{{true}}};  // by coding; raw is known
  std::uint64_t pictures_ = 0;
  PixelCoding last_ = PixelCoding::raw;
};

}  // namespace polyhull
