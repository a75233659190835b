// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A synthetic scene in memory: what a glTF 2.0 file gives after its node transforms are applied.
/// Metres, y up, right-handed; colours linear (Rec. 709 primaries).
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/picture.h"
#include "base/vector.h"
#include "rig/camera.h"

namespace polyhull {

struct Animation;   // scene/animation/animation.h
class Environment;  // environment/environment.h

/// glTF's metallic-roughness material, as the ray tracer and composite draw it.
///
/// With f0 = mix(((ior - 1) / (ior + 1))^2, base colour, metallic) and Schlick's
/// F = f0 + (1 - f0)(1 - cos)^5, cos between the direction to the eye and the normal:
/// - roughness below 0.05 is a mirror: F times the ideally mirrored radiance plus
///   (1 - F) (1 - metallic) base colour / pi times the irradiance;
/// - everything else is a diffuse surface: base colour / pi times the irradiance.
/// Both sides of every surface are drawn.
struct Material {
  std::string name;
  Vec3f base_colour{1.0f};
  int base_colour_texture = -1;  ///< index into Scene::textures (sRGB)
  float metallic = 0.0f;
  float roughness = 1.0f;
  float ior = 1.5f;      ///< KHR_materials_ior
  Vec3f emission{0.0f};  ///< radiance; emissive factor times KHR_materials_emissive_strength
  bool double_sided = false;
  /// Specular reflectance at normal incidence.
  Vec3f f0() const;
  bool is_mirror() const { return roughness < 0.05f; }
  /// Whether all light that comes from it is what it mirrors: smooth metal that does not shine.
  bool only_mirrors() const { return is_mirror() && metallic >= 1.0f && emission == Vec3f(0.0f); }
};

/// A node of the file: what hangs on it moves with it.
struct SceneNode {
  std::string name;
  int parent = -1;     ///< in Scene::nodes, before this one; -1: none
  Mat4 to_world{1.0};  ///< from its own coordinates
};

/// One triangle mesh with one material, in world coordinates.
struct SceneMesh {
  std::string name;
  int material = 0;
  std::vector<Vec3f> positions;
  std::vector<Vec3f> normals;              ///< as many as positions
  std::vector<Vec2f> texture_coordinates;  ///< as many as positions, or none
  std::vector<std::uint32_t> triangles;
  /// How many of it the file has at its node: instances, times pieces that an emitter was cut into.
  std::size_t copies = 1;
  int node = -1;  ///< in Scene::nodes; -1: not known
};

/// A light. Area lights are parallelograms centre +- u +- v that shine to the side of cross(u, v)
/// with constant radiance; point lights have u = v = 0 and intensity (W/sr) in `radiance`. The sun
/// (a directional light) is an area light far away. A spot is an area whose every part has the same
/// intensity, `radiance` per area, in all directions within its cone (spot_cone.h).
struct Light {
  std::string name;
  Vec3f centre{0.0f};
  Vec3f u{0.0f};
  Vec3f v{0.0f};
  Vec3f radiance{0.0f};
  int mesh = -1;  ///< the mesh of the scene that shows the light, -1: not to be seen
  /// A spot's: radians from cross(u, v) up to which it shines fully, and from which not at all.
  float inner_cone = 0.0f, outer_cone = 0.0f;  ///< 0: it is none
  int node = -1;  ///< of the scene's file, in Scene::nodes; -1: not known
  /// A part of an environment that throws no shadow of sharp edges (EnvironmentPart::is_sharp()).
  bool soft = false;
  bool is_area() const { return glm::dot(glm::cross(u, v), glm::cross(u, v)) > 0.0f; }
  bool is_spot() const { return outer_cone > 0.0f && is_area(); }
  bool operator==(const Light&) const = default;
};

/// A planar mirror found from the materials: what lies of some meshes in the plane
/// dot(normal, X) = offset, as the tiles of a floor do; normal towards the side that is reflected.
struct Mirror {
  std::vector<int> meshes{0};  ///< ascending; of materials that mirror alike
  Vec3f normal{0.0f, 1.0f, 0.0f};
  float offset = 0.0f;
  std::vector<Vec3f> outline;  ///< convex hull of the mirror's vertices, in order
  bool has(std::size_t mesh) const {
    return std::binary_search(meshes.begin(), meshes.end(), static_cast<int>(mesh));
  }
  bool operator==(const Mirror&) const = default;
};

/// A picture that copies of a scene have in common.
class SharedPicture {
 public:
  /// Not explicit: a picture is taken for one.
  SharedPicture(Picture picture)  // NOLINT(google-explicit-constructor)
      : picture_(std::make_shared<const Picture>(std::move(picture))) {}
  const Picture& operator*() const { return *picture_; }
  const Picture* operator->() const { return picture_.get(); }

 private:
  std::shared_ptr<const Picture> picture_;
};

/// What there is to be seen, and by what light.
struct Scene {
  std::string name;  ///< the file's path, or "builtin:" and the name of one that ships
  std::vector<Material> materials;
  std::vector<SharedPicture> textures;                       ///< RGBA, sRGB
  std::vector<SceneNode> nodes;                              ///< those of the file that are visible
  std::shared_ptr<const std::vector<Animation>> animations;  ///< of these nodes; null: none
  std::vector<SceneMesh> meshes;
  std::vector<Light> lights;
  Vec3f sky{0.0f};  ///< radiance from where nothing is, below the horizon too
  /// What is there instead, its radiance times `sky`; null: nothing.
  std::shared_ptr<const Environment> environment;
  std::vector<Mirror> mirrors;
  std::vector<Camera> cameras;  ///< glTF cameras at 1280x720, in the pixel conventions of Camera
  float exposure = 1.0f;        ///< picture value (linear, 1 = white) per radiance
  bool exposure_given = false;  ///< by the file: other light does not change it
  std::string left_out;  ///< what the file asks for and nothing draws, a list; empty: nothing
};

/// Reads a glTF 2.0 file (.glb or .gltf, told apart by their content): the triangle meshes of the default
/// scene or, where none is named, of the first that has nodes (one for each instance of
/// EXT_mesh_gpu_instancing), materials (factors, base colour texture, an emissive texture's mean; KHR_materials_pbrSpecularGlossiness, KHR_materials_ior,
/// KHR_materials_emissive_strength, KHR_texture_transform), animations of nodes, perspective cameras,
/// each with a name of its own, and lights (KHR_lights_punctual, with `size` [w, h] in the extras an area light;
/// parallelograms of an emissive material); `exposure` from the scene's extras, or such that a
/// white surface under the mean direct light is shown a little below white (docs/scenes.md). Throws
/// Error: missing file, broken content, numbers that are not finite, no geometry, a texture that
/// cannot be read, a required extension that is not known, too many vertices, triangles or instances.
Scene load_scene(const std::string& path);

/// Writes \p scene as a GLB file that load_scene() reads back. Throws Error.
void save_scene(const Scene& scene, const std::string& path);

/// The planar mirrors among the scene's meshes; curved ones are left out.
std::vector<Mirror> find_mirrors(const Scene& scene);

/// Of \p mirror, one of the scene's: how it mirrors is the same for all that it consists of.
const Material& material_of(const Scene& scene, const Mirror& mirror);

/// In which of Scene::mirrors each triangle of mesh \p mesh lies; -1: in none.
std::vector<int> mirrors_of_triangles(const Scene& scene, std::size_t mesh);

/// Moves and scales light \p index to \p light, and the mesh that shows it (vertices and emission)
/// with it. Throws Error for an index that the scene does not have.
void set_light(Scene& scene, std::size_t index, const Light& light);

/// Brings \p mesh elsewhere; its normals stay on the same side of its triangles, also where \p moved flattens it. As
/// glTF 2.0 has it (section 3.7.4), a reflection turns the triangles' winding round: what was outside stays so.
void move_mesh(const Mat4& moved, SceneMesh& mesh);

/// The radiance from where nothing of \p scene is, seen in \p direction, when Scene::sky is \p sky.
Vec3f sky_radiance(const Scene& scene, const Vec3f& sky, const Vec3f& direction);

/// The box around all meshes. Throws Error for a scene without vertices.
Bounds scene_bounds(const Scene& scene);

/// The camera at \p eye that looks at \p target, \p up upwards in the picture (-z where it looks
/// along that), with \p vertical_fov degrees from the upper to the lower edge of the picture.
/// Throws Error where these do not make a camera (eye = target, field of view not between 0 and
/// 180, empty picture, numbers that are not finite).
Camera look_at(const Vec3& eye, const Vec3& target, double vertical_fov, int width, int height,
               const Vec3& up = Vec3(0, 1, 0));

}  // namespace polyhull
