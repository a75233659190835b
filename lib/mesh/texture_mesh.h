// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From a mesh with its views' pictures to its texturing.
#pragma once

#include "mesh/mesh.h"
#include "texture/fill_colours.h"
#include "texture/texture_hull.h"

namespace polyhull {

/// Textures meshes one after the other and keeps the memory. Not for use by two threads at once.
class MeshTexturer {
 public:
  /// Gives \p mesh its texturing: HullTexturer's, with the fill colours of its views' pixels as they
  /// are now, whether or not the hull changed. Throws Error as HullTexturer::texture() does.
  void texture(Mesh& mesh, const TextureSettings& settings);

  const TextureStatistics& statistics() const { return texturer_.statistics(); }
  double seconds_fill() const { return seconds_fill_; }  ///< of the last call

 private:
  HullTexturer texturer_;
  FillColours fill_;
  double seconds_fill_ = 0.0;
};

/// MeshTexturer for one mesh. Throws Error as it does.
void texture_mesh(Mesh& mesh, const TextureSettings& settings = {});

}  // namespace polyhull
