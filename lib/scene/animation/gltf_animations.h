// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Animations of a glTF file as animations of a scene's nodes.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "gltf/accessor.h"
#include "scene/animation/animation.h"

namespace polyhull {

/// The file's animations, in their order. \p places are the numbers in Scene::nodes of each of the file's
/// nodes that is there and can be animated. What they ask for and nothing does goes into \p left_out, in words. Throws
/// Error, which names animation, channel and node, for keys that are out of order, without a value each,
/// none or not finite, for accessors that cannot be read, and for more keys than memory should hold.
std::vector<Animation> read_animations(const GltfSource& source,
                                       const std::multimap<int, int>& places,
                                       std::set<std::string>& left_out);

}  // namespace polyhull
