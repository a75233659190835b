// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The key signal d = min(a·rgb, b·rgb) for a key colour, in real and in fixed numbers. Internal.
#pragma once

#include <array>

#include "base/vector.h"
#include "silhouette/key/key.h"
#include "silhouette/pixels/chroma.h"
#include "silhouette/pixels/kernels.h"

namespace polyhull::silhouette {

inline Vec3f vector_of(const Rgb& colour) {
  return {colour[0], colour[1], colour[2]};
}

/// Weight vectors over R, G, B as small whole numbers: weight[i] / unit.
struct KeySignal {
  std::array<int, 3> a{}, b{};
  std::array<int, 2> offset{};  ///< added to the two sums, in fixed signal
  double unit = signal_scale;   ///< fixed signal per level
  /// Colour of one level of spill: a·direction = b·direction = 1.
  std::array<double, 3> direction{};
  bool chroma_only = true;  ///< a and b sum to 0: luma does not matter

  double of(double red, double green, double blue) const;
  double of(const Vec3f& colour) const { return of(colour.r, colour.g, colour.b); }
};

/// The signal of a key colour. \p hue: the custom or found colour.
KeySignal key_signal(KeyColour key, const Rgb& hue, double red_gain, double blue_gain);

/// \p signal with its two forms scaled and shifted so that each is linear in the mixing fraction of
/// \p screen and \p foreground and both agree there: min(a·rgb, b·rgb) bends between the two
/// colours where its forms cross, and the half level of a mixed edge would lie off the edge. Other
/// colours than the two count as foreground as far as either form says so, as before.
///
/// The larger of two noisy numbers is too large on average. So the form that tells the two colours
/// apart less well, whose noise weighs more, stays behind the other by two standard deviations at
/// the half level. \p noise: of the signal, levels.
KeySignal calibrated(const KeySignal& signal, const Vec3f& screen, const Vec3f& foreground,
                     double noise);

/// How far a colour is from grey, in levels: the largest channel minus the smallest.
int saturation_of(const Rgb& colour);

/// The signal's weights in the byte order of a four-byte format.
PixelForms pixel_forms(const KeySignal& signal, FrameFormat format);

/// The signal's weights for chroma samples of \p frame (see Kernels::chroma_signal).
struct ChromaForms {
  std::int16_t weights[4];
  std::int32_t offsets[2];
  bool operator==(const ChromaForms&) const = default;
};
ChromaForms chroma_forms(const KeySignal& signal, const FrameView& frame);

}  // namespace polyhull::silhouette
