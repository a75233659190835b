// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A synthetic scene in memory: what a glTF 2.0 file gives after its node transforms are applied.
/// Metres, y up, right-handed; colours linear (Rec. 709 primaries).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/picture.h"
#include "base/vector.h"
#include "rig/camera.h"

namespace polyhull {

/// glTF's metallic-roughness material. A surface of roughness below 0.05 is a mirror: its specular
/// reflection is ideal, weighted by Schlick's Fresnel term.
struct Material {
  std::string name;
  Vec3f base_colour{1.0f};
  int base_colour_texture = -1;  ///< index into Scene::textures (sRGB)
  float metallic = 0.0f;
  float roughness = 1.0f;
  float ior = 1.5f;              ///< KHR_materials_ior
  Vec3f emission{0.0f};          ///< radiance; emissive factor times KHR_materials_emissive_strength
  bool double_sided = false;
  /// Specular reflectance at normal incidence.
  Vec3f f0() const;
  bool is_mirror() const { return roughness < 0.05f; }
};

/// One triangle mesh with one material, in world coordinates.
struct SceneMesh {
  std::string name;
  int material = 0;
  std::vector<Vec3f> positions;
  std::vector<Vec3f> normals;            ///< as many as positions
  std::vector<Vec2f> texture_coordinates;  ///< as many as positions, or none
  std::vector<std::uint32_t> triangles;
};

/// A light. Area lights are parallelograms centre +- u +- v that shine to the side of cross(u, v) with
/// constant radiance; point lights have u = v = 0 and intensity (W/sr) in `radiance`.
struct Light {
  std::string name;
  Vec3f centre{0.0f};
  Vec3f u{0.0f};
  Vec3f v{0.0f};
  Vec3f radiance{0.0f};
  bool is_area() const { return glm::dot(glm::cross(u, v), glm::cross(u, v)) > 0.0f; }
  bool operator==(const Light&) const = default;
};

/// A planar mirror found from the materials: the points with dot(normal, X) = offset inside the
/// outline; normal towards the side that is reflected.
struct Mirror {
  int mesh = 0;
  Vec3f normal{0.0f, 1.0f, 0.0f};
  float offset = 0.0f;
  std::vector<Vec3f> outline;  ///< convex hull of the mirror's vertices, in order
};

struct Scene {
  std::string name;  ///< the file's path, or "builtin:room"
  std::vector<Material> materials;
  std::vector<Picture> textures;  ///< RGBA, sRGB
  std::vector<SceneMesh> meshes;
  std::vector<Light> lights;
  std::vector<Mirror> mirrors;
  std::vector<Camera> cameras;  ///< glTF cameras at 1280x720, in the pixel conventions of Camera
  float exposure = 1.0f;        ///< picture value (linear, 1 = white) per radiance
};

/// Reads a glTF 2.0 file (.glb or .gltf). Throws Error: missing file, broken content, no geometry, a
/// texture that cannot be read.
Scene load_scene(const std::string& path);

/// The built-in room: a polished floor, a table, a pillar that can hide the subject, one area light.
Scene room_scene();

/// load_scene(), or room_scene() for "" and "builtin:room".
Scene open_scene(const std::string& name);

/// Writes \p scene as a GLB file that load_scene() reads back. Throws Error.
void save_scene(const Scene& scene, const std::string& path);

}  // namespace polyhull
