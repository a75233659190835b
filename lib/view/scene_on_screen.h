// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A scene's triangles on the screen, seen by an eye or by its image in a planar mirror.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "raster/covered_blocks.h"
#include "raster/screen_triangles.h"
#include "scene/scene.h"

namespace polyhull {

/// To homogeneous pixels as ScreenTriangles has them; \p camera's distortion is left out.
Mat4 pixels_from_scene(const Camera& camera);

class SceneOnScreen {
 public:
  /// Brings all triangles of \p scene to a screen of \p width x \p height; with \p kept only what
  /// lies on the plane's positive side. On \p threads threads of the pool (0: all), always the
  /// same.
  void set(const Scene& scene, const Mat4& pixels_from_scene, const std::optional<Vec4>& kept,
           int width, int height, int threads);

  /// As ScreenTriangles::draw(): what is nearest, of equals the first in the scene.
  void draw(int band, const SampleRows& rows) const;

  /// Gives \p blocks, which have begun with band \p band, its triangles.
  void look(int band, CoveredBlocks& blocks) const;

  /// As draw() into packed \p rows, which are blocks \p first to \p last of \p blocks.
  void draw(const CoveredBlocks& blocks, int first, int last, const SampleRows& rows) const;

  /// What draw() names; its id counts through the triangles of all meshes.
  const ScreenTriangle& piece(std::uint32_t number) const {
    return parts_[number >> part_bits].piece(number & ((1u << part_bits) - 1u));
  }

 private:
  // Each part has its own numbers, of which clipping takes up to three for a triangle.
  static constexpr unsigned part_bits = 13;
  static constexpr std::size_t part_triangles = 2048;
  static_assert(3 * part_triangles <= std::size_t{1} << part_bits);

  std::vector<ScreenTriangles> parts_;
};

}  // namespace polyhull
