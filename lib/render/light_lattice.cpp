// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/light_lattice.h"

#include <algorithm>
#include <cmath>

#include "base/thread_pool.h"
#include "render/frame.h"
#include "render/light_samples.h"

namespace polyhull {
namespace {

/// Where a point lies among the nodes: the first of the eight around it, and how far beyond it.
struct Cell {
  std::size_t node;
  float share[3];

  Cell(const std::array<int, 3>& size, const Vec3f& point) {
    int low[3];
    for (int k = 0; k < 3; ++k) {
      const int last = size[static_cast<std::size_t>(k)] - 1;
      // NaN counts as 0.
      const float t = point[k] > 0.0f ? std::min(point[k], static_cast<float>(last)) : 0.0f;
      low[k] = std::min(static_cast<int>(t), last - 1);
      share[k] = t - static_cast<float>(low[k]);
    }
    node = static_cast<std::size_t>((low[2] * size[1] + low[1]) * size[0] + low[0]);
  }
};

/// What share of the light that \p light gives to what faces it at \p place a surface of \p normal gets:
/// by the middles of as many parts of it as it looks large from there.
float faced_share(const Light& light, const Vec3f& place, const Vec3f& normal) {
  const Vec3f middle = light.centre - place;
  const float wide = glm::length(glm::cross(light.u, light.v)) / glm::dot(middle, middle);
  const int side = wide < 0.003f ? 1 : wide < 0.03f ? 2 : 4;
  const Vec3f back = light_normal(light);
  float all = 0.0f, got = 0.0f;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const Vec3f way = middle + ((2.0f * i + 1.0f) / side - 1.0f) * light.u +
                        ((2.0f * j + 1.0f) / side - 1.0f) * light.v;
      const float square = std::max(glm::dot(way, way), 1e-6f), distance = std::sqrt(square);
      const float given = light_exit(light, -glm::dot(back, way) / distance) / square;
      all += given;
      got += given * std::max(glm::dot(normal, way) / distance, 0.0f);
    }
  return all > 0.0f ? got / all : 0.0f;
}

/// Unit normals at the vertices of a mesh; 0 where it has no area.
std::vector<Vec3f> normals_of(const Mesh& mesh) {
  const Hull& hull = mesh.hull;
  if (hull.normals.size() == hull.vertices.size()) return hull.normals;
  if (mesh.texturing && mesh.texturing->normals.size() == hull.vertices.size())
    return mesh.texturing->normals;
  std::vector<Vec3f> out(hull.vertices.size(), Vec3f(0.0f));
  for (std::size_t f = 0; f + 2 < hull.triangles.size(); f += 3) {
    const std::uint32_t* v = &hull.triangles[f];
    const Vec3f& a = hull.vertices[v[0]];
    const Vec3f cross = glm::cross(hull.vertices[v[1]] - a, hull.vertices[v[2]] - a);
    for (int k = 0; k < 3; ++k) out[v[k]] += cross;
  }
  for (Vec3f& n : out) {
    const float length = glm::length(n);
    n = length > 0.0f ? n / length : Vec3f(0.0f);
  }
  return out;
}

}  // namespace

void LightMoments::add(const Vec3f& way, const Vec3f& irradiance) {
  for (int k = 0; k < 3; ++k) {
    first[k] += way[k] * irradiance;
    second[k] += way[k] * way[k] * irradiance;
    second[3 + k] += way[k] * way[(k + 1) % 3] * irradiance;
  }
}

void LightMoments::add_even(const Vec3f& irradiance) {
  for (int k = 0; k < 3; ++k) second[k] += 4.0f / 3.0f * irradiance;
}

void LightMoments::add(const LightMoments& other, float share) {
  for (std::size_t k = 0; k < first.size(); ++k) first[k] += share * other.first[k];
  for (std::size_t k = 0; k < second.size(); ++k) second[k] += share * other.second[k];
}

Vec3f LightMoments::irradiance(const Vec3f& normal) const {
  Vec3f straight(0.0f), square(0.0f);
  for (int k = 0; k < 3; ++k) {
    straight += normal[k] * first[k];
    square +=
        normal[k] * normal[k] * second[k] + 2.0f * normal[k] * normal[(k + 1) % 3] * second[3 + k];
  }
  return glm::max(0.375f * mean() + 0.5f * straight + 15.0f / 32.0f * square, Vec3f(0.0f));
}

Vec3f LightLattice::at(const Vec3f& point) const {
  const Cell cell_of(size, point);
  const int dy = size[0], dz = size[0] * size[1];
  const Vec3f* const f = &factors[cell_of.node];
  const auto& share = cell_of.share;
  const auto along_x = [&](const Vec3f* p) { return p[0] + share[0] * (p[1] - p[0]); };
  const auto along_y = [&](const Vec3f* p) {
    const Vec3f a = along_x(p);
    return a + share[1] * (along_x(p + dy) - a);
  };
  const Vec3f a = along_y(f);
  return a + share[2] * (along_y(f + dz) - a);
}

Vec3f LightLattice::form_at(const Vec3f& point, const Vec3f& normal) const {
  const Cell cell_of(size, point);
  float weights[8];
  std::size_t nodes[8];
  LightMoments around;
  for (int corner = 0; corner < 8; ++corner) {
    float weight = 1.0f;
    for (int k = 0; k < 3; ++k)
      weight *= corner >> k & 1 ? cell_of.share[k] : 1.0f - cell_of.share[k];
    weights[corner] = weight;
    nodes[corner] =
        cell_of.node + static_cast<std::size_t>((corner & 1) + (corner >> 1 & 1) * size[0] +
                                                (corner >> 2) * size[0] * size[1]);
    around.add(indirect[nodes[corner]], weight);
  }
  Vec3f given = around.irradiance(normal), mean = around.mean();
  const Vec3f place = origin + cell * point;
  for (std::size_t l = 0; l < lamps.size(); ++l) {
    float facing = 0.0f;
    for (int corner = 0; corner < 8; ++corner)
      facing += weights[corner] * direct[nodes[corner] * lamps.size() + l];
    if (!(facing > 0.0f)) continue;
    const Vec3f power = facing * light_power(lamps[l]);
    given += faced_share(lamps[l], place, normal) * power;
    mean += 0.25f * power;
  }
  Vec3f out;
  for (int c = 0; c < 3; ++c) out[c] = mean[c] > 0.0f ? given[c] / mean[c] : 1.0f;
  return out;
}

std::vector<Vec3f> find_form(const PlacedSubject& subject, const LightLattice& light,
                             float amount) {
  std::vector<Vec3f> out;
  if (subject.image) return out;
  out.assign(subject.points.size(), Vec3f(1.0f));
  const std::vector<Vec3f> normals = normals_of(*subject.mesh);
  const glm::mat3 turn(glm::mat4(subject.local_to_scene));
  parallel_for(out.size(), 256, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3f normal = turn * normals[i];
      const float length = glm::length(normal);
      if (!(length > 0.0f)) continue;
      const Vec3f form =
          light.form_at((subject.points[i] - light.origin) / light.cell, normal / length);
      out[i] += amount * (form - out[i]);
    }
  });
  return out;
}

}  // namespace polyhull
