// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From a mesh with its views' pictures to its texturing.
#pragma once

#include "mesh/mesh.h"
#include "texture/align/align.h"
#include "texture/colour/colour_balance.h"
#include "texture/colour/colour_memory.h"
#include "texture/fill_colours.h"
#include "texture/texture_hull.h"

namespace polyhull {

/// Textures meshes one after the other and keeps the memory, and with `balance` and `memory` what it
/// learned. Not for use by two threads at once.
class MeshTexturer {
 public:
  /// Gives \p mesh its texturing: HullTexturer's, with the gains, the fill colours and the flows of its views'
  /// pixels as they are now, whether or not the hull changed. Throws Error as HullTexturer::texture() does.
  void texture(Mesh& mesh, const TextureSettings& settings);

  /// Forgets what earlier meshes said of the cameras and the subject: the next one is a new stream's first.
  void forget() {
    balance_.reset();
    memory_.reset();
  }

  const TextureStatistics& statistics() const { return texturer_.statistics(); }
  double seconds_balance() const { return seconds_balance_; }           ///< of the last call
  double seconds_fill() const { return seconds_fill_; }                 ///< of the last call
  const AlignStatistics& align_statistics() const { return aligned_; }  ///< of the last call
  double seconds_align() const { return seconds_align_; }               ///< of the last call
  const MemoryStatistics& memory_statistics() const {
    return memory_.statistics();
  }                                                          ///< of the last call
  double seconds_memory() const { return seconds_memory_; }  ///< of the last call

 private:
  HullTexturer texturer_;
  ColourBalance balance_;
  FillColours fill_;
  double seconds_balance_ = 0.0;
  double seconds_fill_ = 0.0;
  PictureAligner aligner_;
  AlignStatistics aligned_;
  double seconds_align_ = 0.0;
  ColourMemory memory_;
  double seconds_memory_ = 0.0;
};

/// MeshTexturer for one mesh. Throws Error as it does.
void texture_mesh(Mesh& mesh, const TextureSettings& settings = {});

}  // namespace polyhull
