// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What comes last on the way to a picture: the light's fall-off towards the corners, and grain.
///
///   L'(d) = L(d) (1 + a1 r^2 + a2 r^4 + a3 r^6)      in linear light, not below 0; r the distance of
///                                                   pixel d from the principal point over the focal
///                                                   length: the real pixel's, distortion included
///   v'(d) = v(d) + 255 grain N(d)                    on the sRGB codes, each channel for itself
///
/// N is Gaussian noise of mean 0 and variance 1, of which autocorrelation is a Gaussian that is as wide
/// as grain_size at half its height. It is taken from one tile of 512 x 512 at a place that the
/// frame's number and the channel choose: the same number, the same grain; others are as good as
/// independent of it.
#pragma once

#include <cstdint>
#include <vector>

#include "rig/camera.h"
#include "scene/viewport_lens.h"

namespace polyhull {

class Sensor {
 public:
  /// Whether \p lens asks for anything of this.
  static bool wanted(const ViewportLens& lens) {
    return lens.grain > 0.0 || lens.falloff != ViewportLens{}.falloff;
  }

  /// Changes the RGBA picture of \p viewport, whose size it has, in rows \p stride bytes apart. Alpha
  /// stays.
  void finish(const ViewportLens& lens, const Camera& viewport, std::uint64_t frame,
              std::uint8_t* pixels, int stride);

 private:
  static constexpr int side = 512;

  struct Row;
  void make_tile(double size);
  void fall_off(const ViewportLens& lens, const Camera& viewport, int y, std::uint8_t* row) const;
  void add_grain(std::uint64_t frame, int width, int y, float scale, std::uint8_t* row) const;

  std::vector<float> white_;  // kept, since the size may change while playing
  double tile_size_ = 0.0;    // grain size that the tile is of
  std::vector<float> tile_;   // rows of side + side numbers: the second half repeats the first
};

}  // namespace polyhull
