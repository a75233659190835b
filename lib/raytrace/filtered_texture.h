// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A texture in linear light with its pyramid, looked up over the footprint of a pixel.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "base/picture.h"
#include "base/vector.h"
#include "raytrace/loops/view_loops.h"
#include "scene/scene.h"

namespace polyhull {

class FilteredTexture {
 public:
  /// \p picture is RGBA, sRGB; it repeats in both directions.
  explicit FilteredTexture(const Picture& picture);
  FilteredTexture(FilteredTexture&&) = default;
  FilteredTexture& operator=(FilteredTexture&&) = default;

  /// Bilinear, without filtering.
  Vec3f at(const Vec2f& uv) const { return over(uv, Vec2f(0.0f), Vec2f(0.0f)); }

  /// The mean over the parallelogram uv +- du/2 +- dv/2 (the steps of the texture coordinates to
  /// the next pixel): trilinear samples along its longer side, as graphics cards do anisotropic
  /// filtering.
  Vec3f over(const Vec2f& uv, const Vec2f& du, const Vec2f& dv) const;

  /// For ViewLoops::best(), as long as this lives.
  TextureLevels levels() const {
    return {texels_.data(), levels_.data(), static_cast<int>(levels_.size())};
  }

 private:
  template <class Texel>
  void add_level(int width, int height, const Texel& texel);

  std::vector<std::uint32_t> texels_;  // of all levels, one after the other
  std::vector<TextureLevel> levels_;
};

/// The texture of \p picture: all scenes of the process that have the picture in common have it in common,
/// too. Any thread.
std::shared_ptr<const FilteredTexture> filtered_texture(const SharedPicture& picture);

}  // namespace polyhull
