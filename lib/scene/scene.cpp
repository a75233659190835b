// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/convex_hull.h"
#include "base/error.h"
#include "environment/environment.h"

namespace polyhull {
namespace {

constexpr std::size_t most_planes_of_a_mesh = 8;  // more of them are a curved surface

struct Plane {
  Vec3f normal;
  float offset;
  std::vector<Vec3f> points;
};

/// The plane of triangle \p number of \p mesh; none where it has no area.
std::optional<Plane> plane_of(const SceneMesh& mesh, std::size_t number) {
  const std::uint32_t* corner = &mesh.triangles[3 * number];
  const Vec3f p[3] = {mesh.positions[corner[0]], mesh.positions[corner[1]],
                      mesh.positions[corner[2]]};
  const Vec3f cross = glm::cross(p[1] - p[0], p[2] - p[0]);
  const float size = glm::length(cross);
  if (!(size > 0.0f)) return std::nullopt;
  const Vec3f normal = cross / size;
  return Plane{normal, glm::dot(normal, (p[0] + p[1] + p[2]) / 3.0f), {p[0], p[1], p[2]}};
}

/// Whether \p plane counts as the one of \p normal and \p offset.
bool same_plane(const Vec3f& normal, float offset, const Plane& plane) {
  return glm::dot(normal, plane.normal) > 1.0f - 1e-6f &&
         std::abs(offset - plane.offset) < 1e-4f * (1.0f + std::abs(plane.offset));
}

/// The planes of a mesh; none where it has so many that it is curved.
std::vector<Plane> planes_of(const SceneMesh& mesh) {
  std::vector<Plane> planes;
  for (std::size_t i = 0; i < mesh.triangles.size() / 3; ++i) {
    const std::optional<Plane> own = plane_of(mesh, i);
    if (!own) continue;
    auto plane = std::find_if(planes.begin(), planes.end(), [&](const Plane& other) {
      return same_plane(other.normal, other.offset, *own);
    });
    if (plane == planes.end()) {
      if (planes.size() == most_planes_of_a_mesh) return {};
      planes.push_back({own->normal, own->offset, {}});
      plane = planes.end() - 1;
    }
    plane->points.insert(plane->points.end(), own->points.begin(), own->points.end());
  }
  return planes;
}

/// Whether what lies in one plane is one mirror where it has these materials.
bool alike(const Material& a, const Material& b) {
  return a.f0() == b.f0() && a.metallic == b.metallic && a.only_mirrors() == b.only_mirrors();
}

/// The convex hull of the plane's points, counter-clockwise around the normal.
std::vector<Vec3f> outline_of(const Plane& plane) {
  const Vec3f aside =
      std::abs(plane.normal.x) < 0.7f ? Vec3f(1.0f, 0.0f, 0.0f) : Vec3f(0.0f, 1.0f, 0.0f);
  const Vec3 x = glm::normalize(glm::cross(Vec3(aside), Vec3(plane.normal)));
  const Vec3 y = glm::cross(Vec3(plane.normal), x);
  std::vector<Vec2> points;
  for (const Vec3f& world : plane.points)
    points.emplace_back(glm::dot(x, Vec3(world)), glm::dot(y, Vec3(world)));
  std::vector<Vec3f> outline;
  for (const std::uint32_t corner : convex_hull(points, 1e-12))
    outline.push_back(plane.points[corner]);
  return outline;
}

}  // namespace

Vec3f Material::f0() const {
  const float dielectric = (ior - 1.0f) / (ior + 1.0f);
  return glm::mix(Vec3f(dielectric * dielectric), base_colour, metallic);
}

std::vector<Mirror> find_mirrors(const Scene& scene) {
  std::vector<Mirror> mirrors;
  std::vector<Plane> planes;  // of each mirror
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    const Material& material = scene.materials.at(scene.meshes[m].material);
    if (!material.is_mirror()) continue;
    for (Plane& own : planes_of(scene.meshes[m])) {
      std::size_t k = 0;
      while (k < mirrors.size() && !(same_plane(planes[k].normal, planes[k].offset, own) &&
                                     alike(material_of(scene, mirrors[k]), material)))
        ++k;
      if (k == mirrors.size()) {
        mirrors.push_back({{}, own.normal, own.offset, {}});
        planes.push_back({own.normal, own.offset, {}});
      }
      mirrors[k].meshes.push_back(static_cast<int>(m));
      planes[k].points.insert(planes[k].points.end(), own.points.begin(), own.points.end());
    }
  }
  for (std::size_t k = 0; k < mirrors.size(); ++k) mirrors[k].outline = outline_of(planes[k]);
  return mirrors;
}

const Material& material_of(const Scene& scene, const Mirror& mirror) {
  return scene.materials[scene.meshes[mirror.meshes[0]].material];
}

std::vector<int> mirrors_of_triangles(const Scene& scene, std::size_t mesh) {
  const SceneMesh& of = scene.meshes[mesh];
  std::vector<int> out(of.triangles.size() / 3, -1);
  std::vector<int> own;  // mirrors of the mesh
  for (std::size_t m = 0; m < scene.mirrors.size(); ++m)
    if (scene.mirrors[m].has(mesh)) own.push_back(static_cast<int>(m));
  if (own.size() == 1) out.assign(out.size(), own[0]);
  for (std::size_t i = 0; own.size() > 1 && i < out.size(); ++i) {
    const std::optional<Plane> plane = plane_of(of, i);
    if (!plane) continue;
    const auto found = std::find_if(own.begin(), own.end(), [&](int m) {
      const Mirror& mirror = scene.mirrors[static_cast<std::size_t>(m)];
      return same_plane(mirror.normal, mirror.offset, *plane);
    });
    if (found != own.end()) out[i] = *found;
  }
  return out;
}

void set_light(Scene& scene, std::size_t index, const Light& light) {
  if (index >= scene.lights.size()) {
    throw Error(Error::Kind::bad_input, "Scene '{}' has {} lights; there is no light {}.",
                scene.name, scene.lights.size(), index);
  }
  Light& old = scene.lights[index];
  const int shown_by = old.mesh;
  if (shown_by >= 0 && old.is_area() && light.is_area()) {
    SceneMesh& mesh = scene.meshes[shown_by];
    const Vec3f n = glm::cross(old.u, old.v);
    const float nn = glm::dot(n, n);
    const Vec3f new_normal = glm::normalize(glm::cross(light.u, light.v));
    for (Vec3f& p : mesh.positions) {
      // The vertex in the light's own coordinates a, b in -1 .. 1.
      const Vec3f d = p - old.centre;
      const float a = glm::dot(glm::cross(d, old.v), n) / nn;
      const float b = glm::dot(glm::cross(old.u, d), n) / nn;
      p = light.centre + a * light.u + b * light.v;
    }
    std::fill(mesh.normals.begin(), mesh.normals.end(), new_normal);
    if (old.radiance != light.radiance) {
      // Another mesh may have the same material: the light's mesh gets one of its own.
      Material material = scene.materials.at(mesh.material);
      material.emission = light.radiance;
      const bool shared =
          std::count_if(scene.meshes.begin(), scene.meshes.end(), [&](const SceneMesh& other) {
            return other.material == mesh.material;
          }) > 1;
      if (shared) {
        mesh.material = static_cast<int>(scene.materials.size());
        scene.materials.push_back(material);
      } else {
        scene.materials[mesh.material] = material;
      }
    }
  }
  old = light;
  old.mesh = shown_by;
}

void move_mesh(const Mat4& moved, SceneMesh& mesh) {
  const Mat3 linear(moved);
  // The cofactor matrix turns normals right under any scaling, also one that flattens the mesh.
  const Mat3 cofactors(glm::cross(linear[1], linear[2]), glm::cross(linear[2], linear[0]),
                       glm::cross(linear[0], linear[1]));
  for (Vec3f& p : mesh.positions) p = Vec3f(moved * Vec4(Vec3(p), 1.0));
  for (Vec3f& n : mesh.normals) {
    const Vec3 turned = cofactors * Vec3(n);
    const double length = glm::length(turned);
    n = length > 0.0 ? Vec3f(turned / length) : Vec3f(0.0f, 1.0f, 0.0f);
  }
  if (glm::determinant(linear) >= 0.0) return;
  for (Vec3f& n : mesh.normals) n = -n;
  for (std::size_t i = 0; i + 2 < mesh.triangles.size(); i += 3)
    std::swap(mesh.triangles[i + 1], mesh.triangles[i + 2]);
}

Vec3f sky_radiance(const Scene& scene, const Vec3f& sky, const Vec3f& direction) {
  return scene.environment ? sky * scene.environment->radiance(direction) : sky;
}

Bounds scene_bounds(const Scene& scene) {
  Bounds bounds{Vec3(std::numeric_limits<double>::infinity()),
                Vec3(-std::numeric_limits<double>::infinity())};
  for (const SceneMesh& mesh : scene.meshes) {
    for (const Vec3f& p : mesh.positions) {
      bounds.min = glm::min(bounds.min, Vec3(p));
      bounds.max = glm::max(bounds.max, Vec3(p));
    }
  }
  if (!(bounds.min.x <= bounds.max.x))
    throw Error(Error::Kind::bad_input, "Scene '{}' has no geometry.", scene.name);
  return bounds;
}

Camera look_at(const Vec3& eye, const Vec3& target, double vertical_fov, int width, int height,
               const Vec3& up) {
  const Vec3 forward = target - eye;
  Vec3 right = glm::cross(forward, up);
  const auto along = [&](const Vec3& upwards) {
    return !(glm::length(right) > 1e-9 * glm::length(forward) * glm::length(upwards));
  };
  const Vec3 other_up(0, 0, -1);
  if (along(up)) right = glm::cross(forward, other_up);
  const auto finite = [](const Vec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
  };
  if (!finite(eye) || !finite(target) || !finite(up) || along(other_up)) {
    throw Error(Error::Kind::bad_input,
                "The viewport needs an eye and a target at different, finite places; the eye is at "
                "({}, {}, {}), the target at ({}, {}, {}). Move one of them.",
                eye.x, eye.y, eye.z, target.x, target.y, target.z);
  }
  if (!(vertical_fov > 0.0 && vertical_fov < 180.0) || width < 1 || height < 1) {
    throw Error(Error::Kind::bad_input,
                "A viewport camera needs a field of view between 0 and 180 degrees and a picture "
                "of at least 1x1 pixels; it got {} degrees and {}x{}.",
                vertical_fov, width, height);
  }
  Camera camera;
  camera.name = "viewport";
  camera.width = width;
  camera.height = height;
  const double focal = 0.5 * height / std::tan(vertical_fov * std::numbers::pi / 360.0);
  camera.K = from_rows({focal, 0, 0.5 * (width - 1), 0, focal, 0.5 * (height - 1), 0, 0, 1});
  const Vec3 x = glm::normalize(right);
  const Vec3 z = glm::normalize(forward);
  const Vec3 y = glm::cross(z, x);
  camera.R = from_rows({x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z});
  camera.t = -(camera.R * eye);
  return camera;
}

}  // namespace polyhull
