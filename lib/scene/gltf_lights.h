// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Lights of a glTF file as area and point lights of a Scene.
#pragma once

#include <tiny_gltf.h>

#include <string>

#include "scene/scene.h"

namespace polyhull {

/// A light of KHR_lights_punctual at a node.
struct PunctualLight {
  const tinygltf::Light* light;
  Mat4 to_world;  ///< from the node's coordinates
  std::string name;
  const tinygltf::Value* node_extras;  ///< null: none
  int node = -1;                       ///< as Light::node
};

/// One light of the scene:
/// - point: a point light; with `size` [w, h] (metres; a number for a square) in the light's or the
///   node's extras an area light that shines along the node's -z with intensity/(w h) as radiance;
/// - spot: the same, 0.2 m square where no size is given, with its cone and intensity/(w h) as
///   radiance in all of it (spot_cone.h);
/// - directional: the sun, an area light 100 scene sizes away, 0.53 degrees wide (`angle` in the
///   extras, degrees, for another softness).
/// Photometric units are taken as they are (1 lx as 1 W/m2): only the exposure differs. \p bounds
/// are the scene's, \p path names it in errors. Throws Error for a size that is not above 0, for a
/// cone that is none and for numbers that are not finite.
Light light_from_punctual(const PunctualLight& light, const Bounds& bounds,
                          const std::string& path);

/// Cuts each emissive mesh into its connected pieces, one mesh each; one that has more than 256 in
/// all its instances stays whole.
void split_emitters(Scene& scene);

/// Adds an area light for each emissive mesh that is a parallelogram of two triangles, unless its
/// node has more than 256 of it (SceneMesh::copies) or there are 1000 already. Other emissive meshes
/// are seen, and light up what one bounce reaches, but are not sampled as lights.
void find_area_lights(Scene& scene);

/// The exposure at which a white surface under the mean direct light (shadows and spots' cones left
/// out, so that what spots light is not burnt out by what they leave dark) is shown at 0.6 of white;
/// 1 for a scene without light. The sky's light counts.
float automatic_exposure(const Scene& scene);

}  // namespace polyhull
