// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Gaussian blur of a matte, u(x) = (G_σ * alpha)(x), with the frame's border values continued
/// outwards.
///
///  - fir: the kernel cut at 3.5σ, what lies beyond put onto its last taps; separable, in 16-bit
///    fixed point; blocks whose whole neighbourhood is uniform are not touched.
///  - box: the prototype's way (thesis 3.4.2): `passes` running means in each direction, their
///    width with fractional ends so that the variance is exactly σ² (P. Gwosdek et al.,
///    "Theoretical foundations of Gaussian convolution by extended box filtering", SSVM 2011).
///  - recursive: sums of cosines, each a second-order recursion (D. Charalampidis, "Recursive
///    implementation of the Gaussian filter using truncated cosine functions", IEEE TSP 64, 2016):
///    time independent of σ.
#pragma once

#include <cstdint>
#include <memory>

#include "silhouette/pixels/matte.h"

namespace polyhull {

enum class BlurMethod : std::uint8_t { fir, box, recursive };

struct BlurSettings {
  BlurMethod method = BlurMethod::fir;
  double sigma = 2.0;  ///< px, 0..100; 0: not blurred
  int passes = 3;      ///< box: 1..10
  /// 1..255: the blurred matte becomes 255 from this level on and 0 below; 0: stays grey.
  int threshold = 0;
  /// Whether a matte comes out as it goes in.
  bool idle() const { return sigma == 0.0 && threshold == 0; }
  bool operator==(const BlurSettings&) const = default;
};

/// Blurs mattes; keeps its working memory.
class Blur {
 public:
  Blur();
  ~Blur();
  Blur(Blur&&) noexcept;
  Blur& operator=(Blur&&) noexcept;

  /// Throws Error (bad_input) for values out of range.
  void set(const BlurSettings& settings);
  const BlurSettings& settings() const;

  /// Blurs a whole matte into \p field, whose size becomes the matte's.
  void apply(const Matte& matte, Field& field);

  struct State;

 private:
  std::unique_ptr<State> state_;
};

}  // namespace polyhull
