// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Scene files of hulls, for tools and tests: a rig, its silhouettes and what is known of their
/// hull.
///
///     {"name": "...", "rig": {polyhull-rig}, "silhouettes": [camera][ring][vertex][u, v],
///      "reference": {"volume": ..., "vertices": ..., "triangles": ..., ...}}
///
/// The region of a silhouette is the even-odd union of its rings; "reference" is optional.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/rings.h"
#include "hull/build/hull_builder.h"
#include "hull/hull.h"
#include "rig/rig.h"

namespace polyhull {

struct HullScene {
  std::string name;
  Rig rig;
  std::vector<Rings> silhouettes;  ///< one per camera of the rig
  std::optional<double> reference_volume;

  /// The silhouettes as HullBuilder takes them; they point into this scene.
  std::vector<Silhouette> views() const;
  std::size_t contour_vertices() const;
};

/// Reads a scene file. Throws Error that names the file and what is wrong.
HullScene load_hull_scene(const std::string& path);

/// Like load_hull_scene() on text; \p source names it in messages.
HullScene parse_hull_scene(std::string_view json, const std::string& source);

/// The scene as text that parse_hull_scene() reads back to the same numbers.
std::string hull_scene_to_json(const HullScene& scene);

/// The rings with holes and outer rings turned as the conventions have it (silhouette on the left
/// as seen on screen), by counting how many other rings each one lies in. Rings must not cross.
void orient_rings(Rings& rings);

}  // namespace polyhull
