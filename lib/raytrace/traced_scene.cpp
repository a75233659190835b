// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/traced_scene.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/thread_pool.h"
#include "environment/environment.h"
#include "raytrace/area_light.h"

namespace polyhull {

TracedScene::TracedScene(Scene scene) : scene_(std::move(scene)) {
  const Bounds bounds = scene_bounds(scene_);
  epsilon_ = static_cast<float>(2e-5 * glm::length(bounds.max - bounds.min));
  for (const SceneMesh& mesh : scene_.meshes) caster_.add_mesh(mesh.positions, mesh.triangles);
  caster_.commit();
  textures_.resize(scene_.textures.size());
  parallel_each(textures_.size(), 1, 0,
                [&](std::size_t i) { textures_[i] = filtered_texture(scene_.textures[i]); });
  light_of_mesh_.assign(scene_.meshes.size(), -1);
  for (std::size_t i = 0; i < scene_.lights.size(); ++i)
    if (scene_.lights[i].mesh >= 0) light_of_mesh_.at(scene_.lights[i].mesh) = static_cast<int>(i);
  find_planar_mirrors();
  mirror_lights();
}

void TracedScene::find_planar_mirrors() {
  planar_mirror_.assign(scene_.meshes.size(), 0);
  for (const Mirror& mirror : scene_.mirrors)
    for (const int mesh : mirror.meshes) planar_mirror_.at(mesh) = 1;
}

void TracedScene::take_pose(const Scene& posed) {
  for (std::size_t m = 0; m < scene_.meshes.size(); ++m) {
    SceneMesh& mesh = scene_.meshes[m];
    if (mesh.positions == posed.meshes[m].positions) continue;
    mesh.positions = posed.meshes[m].positions;
    mesh.normals = posed.meshes[m].normals;
    caster_.move_mesh(static_cast<std::uint32_t>(m), mesh.positions);
    tree_is_behind_ = true;
  }
  for (std::size_t i = 0; i < scene_.lights.size(); ++i) {
    const Vec3f radiance = scene_.lights[i].radiance;
    scene_.lights[i] = posed.lights[i];
    scene_.lights[i].radiance = radiance;
  }
  scene_.mirrors = posed.mirrors;
  find_planar_mirrors();
  mirror_lights();
}

void TracedScene::mirror_lights() {
  mirrored_lights_.clear();
  for (std::size_t m = 0; m < scene_.mirrors.size(); ++m) {
    const Mirror& mirror = scene_.mirrors[m];
    for (std::size_t i = 0; i < scene_.lights.size(); ++i) {
      Light image = scene_.lights[i];
      const float height = glm::dot(mirror.normal, image.centre) - mirror.offset;
      if (height <= epsilon_) continue;
      image.centre -= 2.0f * height * mirror.normal;
      // A mirror image is left-handed: with u and v exchanged it shines to the right side again.
      image.u = glm::reflect(scene_.lights[i].v, mirror.normal);
      image.v = glm::reflect(scene_.lights[i].u, mirror.normal);
      mirrored_lights_.push_back({i, m, image});
    }
  }
}

void TracedScene::build_tree() {
  if (tree_is_behind_) caster_.commit();
  tree_is_behind_ = false;
}

void TracedScene::set_light(std::size_t index, const Light& light) {
  polyhull::set_light(scene_, index, light);
  mirror_lights();
  const int mesh = scene_.lights[index].mesh;
  if (mesh < 0) return;
  caster_.move_mesh(static_cast<std::uint32_t>(mesh), scene_.meshes[mesh].positions);
  caster_.commit();
}

void TracedScene::set_subjects(std::vector<TracedSubject> subjects) {
  for (const std::uint32_t mesh : subject_meshes_) caster_.remove_mesh(mesh);
  subject_meshes_.clear();
  subjects_ = std::move(subjects);
  for (const TracedSubject& subject : subjects_)
    subject_meshes_.push_back(caster_.add_mesh(subject.positions, subject.triangles));
  caster_.commit();
}

Vec3f TracedScene::subject_colour(const RayHit& hit, const Vec3f& direction) const {
  const auto found = std::find(subject_meshes_.begin(), subject_meshes_.end(), hit.mesh);
  const TracedSubject& subject = subjects_[found - subject_meshes_.begin()];
  return subject.colour ? subject.colour(hit.triangle, hit.u, hit.v, direction) : Vec3f(1.0f);
}

Surface TracedScene::plain_surface(const Ray& ray, const RayHit& hit) const {
  const SceneMesh& mesh = scene_.meshes[hit.mesh];
  const std::uint32_t* corner = &mesh.triangles[3 * static_cast<std::size_t>(hit.triangle)];
  const float w0 = 1.0f - hit.u - hit.v;
  Surface surface;
  // From the corners, not along the ray: better by digits, as the ray is long.
  surface.point = w0 * mesh.positions[corner[0]] + hit.u * mesh.positions[corner[1]] +
                  hit.v * mesh.positions[corner[2]];
  const Vec3f normal = w0 * mesh.normals[corner[0]] + hit.u * mesh.normals[corner[1]] +
                       hit.v * mesh.normals[corner[2]];
  surface.back = glm::dot(hit.normal, ray.direction) > 0.0f;
  const float side = surface.back ? -1.0f : 1.0f;
  surface.geometric = hit.normal * (side / glm::length(hit.normal));
  const float length = glm::length(normal);
  surface.normal = length > 0.0f ? normal * (side / length) : surface.geometric;
  surface.material = &scene_.materials[mesh.material];
  surface.light = light_of_mesh_[hit.mesh];
  surface.emission = surface.material->emission;
  if (surface.light >= 0) {
    // A light shines from its front only.
    const Light& light = scene_.lights[surface.light];
    if (glm::dot(glm::cross(light.u, light.v), ray.direction) > 0.0f)
      surface.emission = Vec3f(0.0f);
  }
  return surface;
}

Surface TracedScene::surface(const Ray& ray, const RayHit& hit) const {
  Surface surface = plain_surface(ray, hit);
  const SceneMesh& mesh = scene_.meshes[hit.mesh];
  const std::uint32_t* corner = &mesh.triangles[3 * static_cast<std::size_t>(hit.triangle)];
  const float weights[3] = {1.0f - hit.u - hit.v, hit.u, hit.v};
  const float side = surface.back ? -1.0f : 1.0f;
  surface.lifted = surface.point;
  for (int k = 0; k < 3; ++k) {
    const Vec3f n = side * mesh.normals[corner[k]];
    const float below = std::min(glm::dot(surface.point - mesh.positions[corner[k]], n), 0.0f);
    surface.lifted -= weights[k] * below * n;
  }
  return surface;
}

const FilteredTexture* TracedScene::texture(std::uint32_t mesh) const {
  const int index = scene_.materials[scene_.meshes[mesh].material].base_colour_texture;
  return index < 0 || scene_.meshes[mesh].texture_coordinates.empty() ? nullptr
                                                                      : textures_[index].get();
}

Vec3f TracedScene::base_colour(const RayHit& hit) const {
  const SceneMesh& mesh = scene_.meshes[hit.mesh];
  const Material& material = scene_.materials[mesh.material];
  if (material.base_colour_texture < 0 || mesh.texture_coordinates.empty())
    return material.base_colour;
  const std::uint32_t* corner = &mesh.triangles[3 * static_cast<std::size_t>(hit.triangle)];
  const Vec2f uv = (1.0f - hit.u - hit.v) * mesh.texture_coordinates[corner[0]] +
                   hit.u * mesh.texture_coordinates[corner[1]] +
                   hit.v * mesh.texture_coordinates[corner[2]];
  return material.base_colour * textures_[material.base_colour_texture]->at(uv);
}

Vec3f TracedScene::base_colour(const RayHit& hit, const Vec3f& origin, const Vec3f& direction,
                               const Vec3f& dx, const Vec3f& dy) const {
  const SceneMesh& mesh = scene_.meshes[hit.mesh];
  const Material& material = scene_.materials[mesh.material];
  if (material.base_colour_texture < 0 || mesh.texture_coordinates.empty())
    return material.base_colour;
  const std::uint32_t* corner = &mesh.triangles[3 * static_cast<std::size_t>(hit.triangle)];
  const Vec3f p0 = mesh.positions[corner[0]];
  const Vec3f e1 = mesh.positions[corner[1]] - p0, e2 = mesh.positions[corner[2]] - p0;
  const Vec2f t0 = mesh.texture_coordinates[corner[0]];
  const Vec2f f1 = mesh.texture_coordinates[corner[1]] - t0,
              f2 = mesh.texture_coordinates[corner[2]] - t0;
  const Vec2f uv = t0 + hit.u * f1 + hit.v * f2;
  const Vec3f n = glm::cross(e1, e2);
  const float nn = glm::dot(n, n);
  const float along = glm::dot(direction, n);
  if (!(nn > 0.0f) || along == 0.0f)
    return material.base_colour * textures_[material.base_colour_texture]->at(uv);
  // The derivative of the plane's intersection by the direction, then in the triangle's
  // coordinates.
  const float distance = glm::dot(p0 - origin, n) / along;
  const auto step = [&](const Vec3f& change) {
    const Vec3f moved = distance * (change - glm::dot(change, n) / along * direction);
    const float u = glm::dot(glm::cross(moved, e2), n) / nn;
    const float v = glm::dot(glm::cross(e1, moved), n) / nn;
    // A ray along the surface sees all of it: no more than a texture's whole mean.
    return glm::clamp(u * f1 + v * f2, Vec2f(-4.0f), Vec2f(4.0f));
  };
  return material.base_colour *
         textures_[material.base_colour_texture]->over(uv, step(dx), step(dy));
}

Vec3f light_sample(const TracedScene& scene, const Light& light, const Vec2f& square,
                   const Vec3f& origin, const Vec3f& normal) {
  const LightSample sample = sample_light(light, square, origin, normal);
  if (sample.weight <= 0.0f) return Vec3f(0.0f);
  Ray ray;
  ray.origin = origin;
  ray.direction = sample.place - origin;
  ray.far = 1.0f - 1e-4f;  // not the light's own mesh
  return scene.caster().occluded(ray) ? Vec3f(0.0f) : sample.weight * light.radiance;
}

Vec3f environment_sample(const TracedScene& scene, const Vec2f& square, const Vec3f& origin,
                         const Vec3f& normal) {
  const EnvironmentSample sample = scene.scene().environment->sample(square);
  const float cosine = glm::dot(normal, sample.direction);
  if (!(sample.density > 0.0f) || cosine <= 0.0f) return Vec3f(0.0f);
  Ray ray;
  ray.origin = origin;
  ray.direction = sample.direction;
  if (scene.caster().occluded(ray)) return Vec3f(0.0f);
  return scene.scene().sky * sample.radiance * (cosine / sample.density);
}

Vec3f mirrored_share(const TracedScene& scene, const MirroredLight& light, const Vec2f& square,
                     const Vec3f& origin, const Vec3f& normal) {
  const LightSample sample = sample_light(light.image, square, origin, normal);
  if (sample.weight <= 0.0f) return Vec3f(0.0f);
  const Mirror& mirror = scene.scene().mirrors[light.mirror];
  Ray ray;
  ray.origin = origin;
  ray.direction = sample.place - origin;
  const RayHit hit = scene.caster().intersect(ray);
  if (!mirror.has(hit.mesh) || hit.distance >= 1.0f) return Vec3f(0.0f);
  const Vec3f met = origin + hit.distance * ray.direction;
  // A mesh may have several planes.
  if (std::abs(glm::dot(met, mirror.normal) - mirror.offset) > 10.0f * scene.epsilon())
    return Vec3f(0.0f);
  Ray onward;
  onward.origin = met + scene.epsilon() * mirror.normal;
  onward.direction =
      sample.place -
      2.0f * (glm::dot(sample.place, mirror.normal) - mirror.offset) * mirror.normal -
      onward.origin;
  onward.far = 1.0f - 1e-4f;
  if (scene.caster().occluded(onward)) return Vec3f(0.0f);
  const Material& material = scene.scene().materials[scene.scene().meshes[hit.mesh].material];
  const float cosine = std::abs(glm::dot(glm::normalize(ray.direction), mirror.normal));
  return fresnel(material.f0(), cosine);
}

Vec3f mirrored_light_sample(const TracedScene& scene, const MirroredLight& light,
                            const Vec2f& square, const Vec3f& origin, const Vec3f& normal) {
  const float weight = sample_light(light.image, square, origin, normal).weight;
  return weight * mirrored_share(scene, light, square, origin, normal) * light.image.radiance;
}

}  // namespace polyhull
