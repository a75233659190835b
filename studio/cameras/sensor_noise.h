// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Gaussian noise for 8-bit pictures, the same for the same seed, camera and frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace polyhull {

/// Largest standard deviation: the noise is kept within +-127 levels.
inline constexpr double largest_noise = 30.0;

/// The noise of one camera; add() may run on several threads.
class SensorNoise {
 public:
  /// Adds noise of standard deviation \p deviation levels to the colours of a row of RGBA pixels,
  /// independent per pixel and colour; alpha stays. \p key chooses the noise.
  void add(double deviation, std::uint64_t key, std::uint8_t* pixels, std::size_t count) const;

  /// Makes add() ready for \p deviation (levels, up to largest_noise). To be called first, from one
  /// thread.
  void prepare(double deviation);

 private:
  double deviation_ = -1.0;
  std::shared_ptr<const std::vector<std::int8_t>> table_;
};

/// A well mixed function of its argument (SplitMix64's finaliser).
std::uint64_t mix_bits(std::uint64_t x);

}  // namespace polyhull
