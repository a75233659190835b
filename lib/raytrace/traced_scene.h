// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A scene ready for rays: geometry in Embree's tree, textures filtered, lights, and subjects whose
/// light is given.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "raytrace/filtered_texture.h"
#include "raytrace/ray_caster.h"
#include "scene/scene.h"

namespace polyhull {

/// A body that shows colours of its own whatever the scene's light (matched lighting: what its
/// cameras saw): it blocks light, is mirrored and colours its surroundings.
struct TracedSubject {
  std::vector<Vec3f> positions;
  std::vector<std::uint32_t> triangles;
  /// The linear picture value (1 = white) at a point of a triangle, seen against \p direction (unit
  /// length, from the eye). Called from several threads. Empty: a white body.
  std::function<Vec3f(std::uint32_t triangle, float u, float v, const Vec3f& direction)> colour;
};

/// What a ray met.
struct Surface {
  Vec3f point{0.0f};
  Vec3f normal{0.0f};     ///< shading normal, unit length, on the ray's side
  Vec3f geometric{0.0f};  ///< of the triangle, unit length, on the ray's side
  /// The point lifted to the smooth surface that the normals describe, so that its own facets throw
  /// no shadow on it (Hanika, "Hacking the Shadow Terminator", Ray Tracing Gems II, 2021).
  Vec3f lifted{0.0f};
  const Material* material = nullptr;
  int light = -1;     ///< the light that this is, or -1
  bool back = false;  ///< seen from the back of the triangle
  Vec3f emission{0.0f};
};

/// A light as a planar mirror shows it: behind the mirror's plane.
struct MirroredLight {
  std::size_t light;   ///< index into Scene::lights
  std::size_t mirror;  ///< index into Scene::mirrors
  Light image;
};

class TracedScene {
 public:
  /// Throws Error as RayCaster does.
  explicit TracedScene(Scene scene);

  const Scene& scene() const { return scene_; }
  const RayCaster& caster() const { return caster_; }

  /// Lengths below this are rounding: how far rays start from a surface.
  float epsilon() const { return epsilon_; }

  /// Every light in every planar mirror that it shines on.
  const std::vector<MirroredLight>& mirrored_lights() const { return mirrored_lights_; }

  /// Whether the mesh is one of Scene::mirrors.
  bool is_planar_mirror(std::uint32_t mesh) const { return planar_mirror_[mesh] != 0; }

  /// As the free set_light(), with the tree kept in step.
  void set_light(std::size_t index, const Light& light);

  /// Takes over where meshes, lights and mirrors are in \p posed, the same scene in another pose: as many
  /// meshes with as many vertices. Lights stay as bright as they are. Rays need build_tree() then.
  void take_pose(const Scene& posed);

  /// Has rays find everything where the last take_pose() put it; costs nothing where they do.
  void build_tree();
  /// As sky_radiance().
  Vec3f sky(const Vec3f& direction) const { return sky_radiance(scene_, scene_.sky, direction); }

  /// As Scene::sky.
  void set_sky(const Vec3f& sky) { scene_.sky = sky; }

  /// As Scene::exposure.
  void set_exposure(float exposure) { scene_.exposure = exposure; }

  /// Replaces the subjects.
  void set_subjects(std::vector<TracedSubject> subjects);
  bool is_subject(const RayHit& hit) const { return hit.mesh >= scene_.meshes.size(); }

  /// Linear picture value of a hit on a subject.
  Vec3f subject_colour(const RayHit& hit, const Vec3f& direction) const;

  /// The surface at a hit that is not on a subject.
  Surface surface(const Ray& ray, const RayHit& hit) const;
  /// The same without Surface::lifted: faster.
  Surface plain_surface(const Ray& ray, const RayHit& hit) const;

  /// The base colour at a hit, without filtering.
  Vec3f base_colour(const RayHit& hit) const;

  /// The base colour over the footprint of a pixel: \p origin and \p direction of the ray, \p dx
  /// and \p dy the changes of its direction to the next pixel.
  Vec3f base_colour(const RayHit& hit, const Vec3f& origin, const Vec3f& direction, const Vec3f& dx,
                    const Vec3f& dy) const;

  /// The texture of a mesh's base colour, null where it has none.
  const FilteredTexture* texture(std::uint32_t mesh) const;

 private:
  void find_planar_mirrors();
  void mirror_lights();

  Scene scene_;
  RayCaster caster_;
  bool tree_is_behind_ = false;
  float epsilon_ = 0.0f;
  std::vector<std::shared_ptr<const FilteredTexture>> textures_;
  std::vector<int> light_of_mesh_;
  std::vector<char> planar_mirror_;  // by mesh
  std::vector<MirroredLight> mirrored_lights_;
  std::vector<TracedSubject> subjects_;
  std::vector<std::uint32_t> subject_meshes_;
};

/// Schlick's approximation of Fresnel reflectance.
inline Vec3f fresnel(const Vec3f& f0, float cosine) {
  const float x = 1.0f - (cosine < 0.0f ? 0.0f : cosine > 1.0f ? 1.0f : cosine);
  const float x2 = x * x;
  return f0 + (Vec3f(1.0f) - f0) * (x2 * x2 * x);
}

/// The irradiance that one way to \p light brings to a point: from \p origin (where rays from the
/// point start) with unit normal \p normal to the place \p square of the light. Its mean over
/// uniform places is the irradiance.
Vec3f light_sample(const TracedScene& scene, const Light& light, const Vec2f& square,
                   const Vec3f& origin, const Vec3f& normal);

/// As light_sample(), of the scene's environment, which there is.
Vec3f environment_sample(const TracedScene& scene, const Vec2f& square, const Vec3f& origin,
                         const Vec3f& normal);

/// What a planar mirror leaves of one way from \p origin to a light's image in it: the mirror's
/// reflectance, or 0 where something is in between.
Vec3f mirrored_share(const TracedScene& scene, const MirroredLight& light, const Vec2f& square,
                     const Vec3f& origin, const Vec3f& normal);

/// As light_sample() by way of a planar mirror, weighted by the mirror's reflectance.
Vec3f mirrored_light_sample(const TracedScene& scene, const MirroredLight& light,
                            const Vec2f& square, const Vec3f& origin, const Vec3f& normal);

}  // namespace polyhull
