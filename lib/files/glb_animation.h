// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A performance as one GLB file: a node per mesh, of which an animation shows one at a time.
#pragma once

#include <memory>
#include <string>

#include "files/mesh_files.h"

namespace polyhull {

/// Each mesh is a node whose scale an animation ("take", interpolation STEP) switches from 0 to 1 for
/// as long as it is to be seen, which every glTF player and Blender understand; players without
/// animations show the first. All is kept in memory until it is written.
class GlbAnimation {
 public:
  explicit GlbAnimation(const MeshFileOptions& options = {});
  ~GlbAnimation();

  /// Adds \p mesh, seen from \p seconds until the next is; times rise. World and unit are the first
  /// mesh's. Throws Error: times that do not rise, more than a GLB file holds.
  void add(const Mesh& mesh, double seconds);

  /// Writes the file; once. Throws Error (io, or there is no mesh).
  void write(const std::string& path);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace polyhull
