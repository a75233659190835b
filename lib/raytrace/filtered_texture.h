// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A texture in linear light with its pyramid, looked up over the footprint of a pixel.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/picture.h"
#include "base/vector.h"
#include "raytrace/float4.h"

namespace polyhull {

class FilteredTexture {
 public:
  /// \p picture is RGBA, sRGB; it repeats in both directions.
  explicit FilteredTexture(const Picture& picture);

  /// Bilinear, without filtering.
  Vec3f at(const Vec2f& uv) const { return to_vector(bilinear(0, uv)); }

  /// The mean over the parallelogram uv +- du/2 +- dv/2 (the steps of the texture coordinates to
  /// the next pixel): trilinear samples along its longer side, as graphics cards do anisotropic
  /// filtering.
  Vec3f over(const Vec2f& uv, const Vec2f& du, const Vec2f& dv) const;

 private:
  struct Level {
    int width = 0;
    int height = 0;
    std::vector<std::array<std::uint16_t, 4>> texels;
  };
  Float4 bilinear(std::size_t level, const Vec2f& uv) const;
  Float4 trilinear(float level, const Vec2f& uv) const;

  std::vector<Level> levels_;
};

}  // namespace polyhull
