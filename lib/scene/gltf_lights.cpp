// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/gltf_lights.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <tuple>

#include "base/error.h"
#include "environment/environment.h"
#include "scene/assumed_light.h"

namespace polyhull {
namespace {

constexpr float pi = std::numbers::pi_v<float>;
constexpr double default_spot_size = 0.2;  // metres
constexpr double sun_angle = 0.53;         // degrees
constexpr std::size_t most_copies = 256;   // of one emissive mesh; more are no lamps
constexpr std::size_t most_lamps = 1000;   // of emissive meshes; announcements hold 1024 lights

const tinygltf::Value* find(const tinygltf::Value* extras, const char* name) {
  return extras && extras->IsObject() && extras->Has(name) ? &extras->Get(name) : nullptr;
}

/// Union-find over the corners that lie at one place.
std::vector<int> pieces_of(const SceneMesh& mesh) {
  std::map<std::tuple<float, float, float>, std::size_t> first_triangle;
  std::vector<std::size_t> parent(mesh.triangles.size() / 3);
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (std::size_t i = 0; i < 3 * parent.size(); ++i) {
    const Vec3f& p = mesh.positions[mesh.triangles[i]];
    const auto [place, fresh] = first_triangle.try_emplace({p.x, p.y, p.z}, i / 3);
    if (!fresh) parent[root(i / 3)] = root(place->second);
  }
  std::map<std::size_t, int> numbers;
  std::vector<int> piece(parent.size());
  for (std::size_t i = 0; i < parent.size(); ++i)
    piece[i] = numbers.try_emplace(root(i), static_cast<int>(numbers.size())).first->second;
  return piece;
}

/// The parallelogram that two triangles make, as corner and edges in order around it.
bool parallelogram(const SceneMesh& mesh, Vec3f& corner, Vec3f& a, Vec3f& b) {
  if (mesh.triangles.size() != 6) return false;
  const auto p = [&](int i) { return mesh.positions[mesh.triangles[i]]; };
  for (int k = 0; k < 3; ++k) {
    // The vertex of the first triangle that the second does not have.
    if (p(k) == p(3) || p(k) == p(4) || p(k) == p(5)) continue;
    corner = p(k);
    a = p((k + 1) % 3) - corner;
    b = p((k + 2) % 3) - corner;
    const float tolerance = 1e-4f * (glm::length(a) + glm::length(b));
    for (int j = 3; j < 6; ++j)
      if (glm::length(p(j) - (corner + a + b)) < tolerance)
        return glm::length(glm::cross(a, b)) > 0.0f;
  }
  return false;
}

/// The cone of a spot. Angles are rounded by who writes them, and a cone without a soft border is
/// common though the extension asks for inner < outer.
void take_cone(const PunctualLight& in, const std::string& path, Light& light) {
  constexpr double rounded = 1e-4;
  const double inner = in.light->spot.innerConeAngle, outer = in.light->spot.outerConeAngle;
  if (!(inner >= 0.0 && inner <= outer + rounded && outer > 0.0 &&
        outer <= std::numbers::pi / 2.0 + rounded)) {
    throw Error(
        Error::Kind::bad_input,
        "Scene '{}': the cone of light '{}' has innerConeAngle {:g} and outerConeAngle {:g}; "
        "expected radians with 0 <= inner < outer <= pi/2.",
        path, light.name, inner, outer);
  }
  light.outer_cone = static_cast<float>(std::min(outer, std::numbers::pi / 2.0));
  light.inner_cone = std::min(static_cast<float>(inner), light.outer_cone);
}

}  // namespace

Light light_from_punctual(const PunctualLight& in, const Bounds& bounds, const std::string& path) {
  Light light;
  light.name = !in.name.empty() ? in.name : in.light->name;
  light.node = in.node;
  Vec3 colour(1.0);
  if (in.light->color.size() >= 3)
    colour = Vec3(in.light->color[0], in.light->color[1], in.light->color[2]);
  const Vec3 power = colour * in.light->intensity;
  const Vec3 centre(in.to_world[3]);
  const auto direction = [&](int column) {
    const Vec3 v(in.to_world[column]);
    const double length = glm::length(v);
    return length > 0.0 ? v / length : Vec3(column == 0, column == 1, column == 2);
  };
  const Vec3 x = direction(0), y = direction(1), z = direction(2);
  light.centre = Vec3f(centre);
  const tinygltf::Value* size = find(&in.light->extras, "size");
  if (!size) size = find(in.node_extras, "size");
  if (in.light->type == "directional") {
    const tinygltf::Value* angle = find(&in.light->extras, "angle");
    if (!angle) angle = find(in.node_extras, "angle");
    const double degrees = angle && angle->IsNumber() ? angle->GetNumberAsDouble() : sun_angle;
    // The light's -z points from the sun to the scene.
    set_sun(bounds, Mat3(x, y, z), power, std::clamp(degrees, 0.01, 90.0), light);
  } else if (size || in.light->type == "spot") {
    double width = default_spot_size, height = default_spot_size;
    if (size && size->IsArray() && size->ArrayLen() == 2) {
      width = size->Get(0).GetNumberAsDouble();
      height = size->Get(1).GetNumberAsDouble();
    } else if (size && size->IsNumber()) {
      width = height = size->GetNumberAsDouble();
    }
    if (!(width > 0.0 && height > 0.0)) {
      throw Error(Error::Kind::bad_input,
                  "Scene '{}': the size of light '{}' must be two lengths above 0 (metres).", path,
                  light.name);
    }
    light.u = Vec3f(0.5 * height * y);  // cross(y, x) = -z
    light.v = Vec3f(0.5 * width * x);
    light.radiance = Vec3f(power / (width * height));
    if (in.light->type == "spot") take_cone(in, path, light);
  } else {
    light.radiance = Vec3f(power);
  }
  for (int k = 0; k < 3; ++k) {
    if (!std::isfinite(light.centre[k]) || !std::isfinite(light.u[k]) ||
        !std::isfinite(light.v[k]) || !std::isfinite(light.radiance[k]) ||
        light.radiance[k] < 0.0f) {
      throw Error(Error::Kind::bad_input,
                  "Scene '{}': light '{}' has a number that is not finite or is below 0.", path,
                  light.name);
    }
  }
  return light;
}

void split_emitters(Scene& scene) {
  std::vector<SceneMesh> pieces_found;
  for (SceneMesh& mesh : scene.meshes) {
    if (scene.materials[mesh.material].emission == Vec3f(0.0f) || mesh.copies > most_copies)
      continue;
    const std::vector<int> piece = pieces_of(mesh);
    const std::size_t count =
        piece.empty() ? 0 : *std::max_element(piece.begin(), piece.end()) + 1u;
    if (count < 2 || count * mesh.copies > most_copies) continue;
    std::vector<SceneMesh> parts(count);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      SceneMesh& part = parts[piece[i / 3]];
      const std::uint32_t index = mesh.triangles[i];
      part.triangles.push_back(static_cast<std::uint32_t>(part.positions.size()));
      part.positions.push_back(mesh.positions[index]);
      part.normals.push_back(mesh.normals[index]);
      if (!mesh.texture_coordinates.empty())
        part.texture_coordinates.push_back(mesh.texture_coordinates[index]);
    }
    for (std::size_t i = 0; i < count; ++i) {
      parts[i].material = mesh.material;
      parts[i].copies = count * mesh.copies;
      parts[i].node = mesh.node;
      parts[i].name = i ? fmt::format("{}.{}", mesh.name, i) : mesh.name;
    }
    mesh = std::move(parts[0]);
    std::move(parts.begin() + 1, parts.end(), std::back_inserter(pieces_found));
  }
  std::move(pieces_found.begin(), pieces_found.end(), std::back_inserter(scene.meshes));
}

void find_area_lights(Scene& scene) {
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    const SceneMesh& mesh = scene.meshes[m];
    const Vec3f emission = scene.materials[mesh.material].emission;
    Vec3f corner, a, b;
    if (scene.lights.size() == most_lamps) break;
    if (emission == Vec3f(0.0f) || mesh.copies > most_copies || !parallelogram(mesh, corner, a, b))
      continue;
    Light light;
    light.name = mesh.name;
    light.centre = corner + 0.5f * (a + b);
    light.u = 0.5f * a;
    light.v = 0.5f * b;
    light.radiance = emission;
    light.mesh = static_cast<int>(m);
    light.node = mesh.node;
    scene.lights.push_back(std::move(light));
  }
}

float automatic_exposure(const Scene& scene) {
  double irradiance = 0.0, area = 0.0;
  for (const SceneMesh& mesh : scene.meshes) {
    for (std::size_t i = 0; i + 2 < mesh.triangles.size(); i += 3) {
      const Vec3f p0 = mesh.positions[mesh.triangles[i]],
                  p1 = mesh.positions[mesh.triangles[i + 1]],
                  p2 = mesh.positions[mesh.triangles[i + 2]];
      const Vec3f cross = glm::cross(p1 - p0, p2 - p0);
      const float length = glm::length(cross);
      if (!(length > 0.0f)) continue;
      const Vec3f normal = cross / length, point = (p0 + p1 + p2) / 3.0f;
      const Vec3f sky =
          scene.environment ? scene.sky * scene.environment->irradiance(normal) / pi : scene.sky;
      float sum = pi * (sky.x + sky.y + sky.z) / 3.0f;
      for (const Light& light : scene.lights) {
        const Vec3f to_light = light.centre - point;
        const float squared = std::max(glm::dot(to_light, to_light), 1e-6f);
        const float cosine = std::max(glm::dot(normal, to_light), 0.0f) / std::sqrt(squared);
        const float brightness = (light.radiance.x + light.radiance.y + light.radiance.z) / 3.0f;
        if (light.is_area()) {
          const Vec3f n = glm::cross(light.u, light.v);  // a quarter of the area, along the normal
          const float towards = std::max(-glm::dot(n, to_light), 0.0f) / std::sqrt(squared);
          // Close to the light the point formula has no bound; the true value has: pi.
          sum += brightness * std::min(4.0f * towards * cosine / squared, pi);
        } else {
          sum += brightness * cosine / squared;
        }
      }
      irradiance += 0.5 * length * sum;
      area += 0.5 * length;
    }
  }
  if (!(irradiance > 0.0)) return 1.0f;
  return static_cast<float>(0.6 * pi * area / irradiance);
}

}  // namespace polyhull
