// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a view of a scene has ready once it is drawn, for whoever in the process needs the same view:
/// its triangles brought to the screen, each the plane of its depths there. Making them costs a pass
/// over all vertices and triangles; depths and normals at any sample follow from them alone.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "view/scene_on_screen.h"

namespace polyhull {

struct ScenePlanes {
  std::uint64_t geometry = 0;  ///< geometry_key() of the scene
  Mat4 pixels_from_scene{1.0};
  int width = 0, height = 0;
  std::shared_ptr<const SceneOnScreen> triangles;  ///< of all of the scene, with these three

  /// Whether they are what SceneOnScreen::set() would make of a scene with this key: to the bit.
  bool are_of(std::uint64_t key, const Mat4& pixels, int columns, int rows) const {
    return key == geometry && pixels == pixels_from_scene && columns == width && rows == height;
  }
};

/// A number for the triangles of a scene's meshes: where they are, and in which order.
std::uint64_t geometry_key(const Scene& scene);

/// The triangles of \p planes (may be null) where they are of this view of \p scene, else null. \p key:
/// geometry_key() of it, found here once it is needed; to be reset with another scene.
std::shared_ptr<const SceneOnScreen> ready_triangles(const ScenePlanes* planes, const Scene& scene,
                                                     std::optional<std::uint64_t>& key,
                                                     const Mat4& pixels_from_scene, int width,
                                                     int height);

}  // namespace polyhull
