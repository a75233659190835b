// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/surface_grid.h"

#include <algorithm>
#include <cmath>

namespace polyhull {
namespace {

constexpr float inset =
    1e-3f;  // metres; a node on the very edge may lie in the neighbour's surface
constexpr std::uint16_t most_cells = 2048;  // along one side

std::uint16_t cells(float length, float spacing) {
  return static_cast<std::uint16_t>(
      std::clamp(std::ceil(length / spacing), 1.0f, static_cast<float>(most_cells)));
}

}  // namespace

SurfaceGrid::SurfaceGrid(const Scene& scene, float spacing, std::size_t most_nodes) {
  do {
    spacing_ = spacing;
    lay_out(scene, spacing);
    spacing *= 1.5f;
  } while (node_count_ > most_nodes && can_be_coarser());
}

/// Whether larger cells save nodes worth the name. Vertices do not become fewer: a scene of many
/// small triangles is as large as it is.
bool SurfaceGrid::can_be_coarser() const {
  std::size_t grids = 0, nodes = 0;
  for (const Patch& patch : patches_) {
    if (patch.kind == Kind::vertices) continue;
    ++grids;
    nodes += (patch.ns + 1u) * (patch.nt + 1u);
  }
  return nodes > 8 * grids;
}

void SurfaceGrid::add_patch(Patch patch) {
  patch.first_node = static_cast<std::uint32_t>(node_count_);
  node_count_ += (patch.ns + 1u) * (patch.nt + 1u);
  patches_.push_back(patch);
}

void SurfaceGrid::lay_out(const Scene& scene, float spacing) {
  patches_.clear();
  triangles_.clear();
  first_triangle_.clear();
  mesh_indices_.clear();
  vertex_triangles_.clear();
  node_count_ = 0;
  for (std::uint32_t m = 0; m < scene.meshes.size(); ++m) {
    const SceneMesh& mesh = scene.meshes[m];
    first_triangle_.push_back(triangles_.size());
    mesh_indices_.push_back(mesh.triangles.data());
    const std::size_t count = mesh.triangles.size() / 3;
    std::uint32_t vertex_patch = RayHit::none;
    for (std::size_t i = 0; i < count; ++i) {
      if (i + 1 < count && add_parallelogram(mesh, m, i, spacing)) {
        ++i;
        continue;
      }
      float longest = 0.0f;
      for (std::size_t k = 0; k < 3; ++k) {
        longest =
            std::max(longest, glm::length(mesh.positions[mesh.triangles[3 * i + k]] -
                                          mesh.positions[mesh.triangles[3 * i + (k + 1) % 3]]));
      }
      if (longest > 1.5f * spacing) {
        add_fan(mesh, m, i, spacing);
        continue;
      }
      if (vertex_patch == RayHit::none) {
        vertex_patch = static_cast<std::uint32_t>(patches_.size());
        Patch patch;
        patch.kind = Kind::vertices;
        patch.mesh = m;
        patch.first_node = static_cast<std::uint32_t>(node_count_);
        patch.first_vertex = static_cast<std::uint32_t>(vertex_triangles_.size());
        vertex_triangles_.resize(vertex_triangles_.size() + mesh.positions.size(), 0);
        for (std::uint32_t j = 0; j < mesh.triangles.size() / 3 * 3; ++j)
          vertex_triangles_[patch.first_vertex + mesh.triangles[j]] = j;
        node_count_ += mesh.positions.size();
        patches_.push_back(patch);
      }
      triangles_.push_back({vertex_patch, 0, 0, 0});
    }
  }
}

bool SurfaceGrid::add_parallelogram(const SceneMesh& mesh, std::uint32_t mesh_index,
                                    std::size_t triangle, float spacing) {
  const std::uint32_t* first = &mesh.triangles[3 * triangle];
  const std::uint32_t* second = first + 3;
  const auto p = [&](std::uint32_t vertex) { return mesh.positions[vertex]; };
  const Vec3f normal = mesh.normals[first[0]];
  for (int k = 0; k < 6; ++k)
    if (glm::dot(mesh.normals[first[k]], normal) < 1.0f - 1e-6f) return false;
  for (int k = 0; k < 3; ++k) {
    // The corner of the first triangle that lies across the diagonal.
    const std::uint32_t corner = first[k], a = first[(k + 1) % 3], b = first[(k + 2) % 3];
    const Vec3f fourth = p(a) + p(b) - p(corner);
    const float tolerance = 1e-5f * glm::length(p(a) - p(b));
    const auto same = [&](std::uint32_t vertex, const Vec3f& place) {
      return glm::length(p(vertex) - place) <= tolerance;
    };
    std::uint8_t s_bits = 0, t_bits = 0;
    int matched = 0;
    for (int j = 0; j < 3; ++j) {
      const bool at_a = same(second[j], p(a)), at_b = same(second[j], p(b)),
                 at_fourth = same(second[j], fourth);
      matched |= at_a ? 1 : at_b ? 2 : at_fourth ? 4 : 0;
      if (at_a || at_fourth) s_bits = static_cast<std::uint8_t>(s_bits | (1u << j));
      if (at_b || at_fourth) t_bits = static_cast<std::uint8_t>(t_bits | (1u << j));
    }
    if (matched != 7) continue;
    const float length_s = glm::length(p(a) - p(corner)), length_t = glm::length(p(b) - p(corner));
    if (std::max(length_s, length_t) <= spacing) return false;  // the vertices do as well
    Patch patch;
    patch.kind = Kind::parallelogram;
    patch.mesh = mesh_index;
    patch.triangle = static_cast<std::uint32_t>(triangle);
    patch.corners[0] = corner;
    patch.corners[1] = a;
    patch.corners[2] = b;
    patch.ns = cells(length_s, spacing);
    patch.nt = cells(length_t, spacing);
    const auto index = static_cast<std::uint32_t>(patches_.size());
    add_patch(patch);
    triangles_.push_back({index, 0, static_cast<std::uint8_t>(1u << ((k + 1) % 3)),
                          static_cast<std::uint8_t>(1u << ((k + 2) % 3))});
    triangles_.push_back({index, 0, s_bits, t_bits});
    return true;
  }
  return false;
}

void SurfaceGrid::add_fan(const SceneMesh& mesh, std::uint32_t mesh_index, std::size_t triangle,
                          float spacing) {
  const std::uint32_t* corner = &mesh.triangles[3 * triangle];
  float lengths[3];  // of the edge opposite each corner
  for (int k = 0; k < 3; ++k) {
    lengths[k] =
        glm::length(mesh.positions[corner[(k + 1) % 3]] - mesh.positions[corner[(k + 2) % 3]]);
  }
  const auto apex = static_cast<std::uint8_t>(std::min_element(lengths, lengths + 3) - lengths);
  Patch patch;
  patch.kind = Kind::fan;
  patch.triangle = static_cast<std::uint32_t>(triangle);
  patch.mesh = mesh_index;
  for (int k = 0; k < 3; ++k) patch.corners[k] = corner[(apex + k) % 3];
  patch.ns = cells(std::max(lengths[(apex + 1) % 3], lengths[(apex + 2) % 3]), spacing);
  patch.nt = cells(lengths[apex], spacing);
  triangles_.push_back({static_cast<std::uint32_t>(patches_.size()), apex, 0, 0});
  add_patch(patch);
}

std::size_t SurfaceGrid::patch_of(std::size_t node) const {
  const auto after = std::upper_bound(
      patches_.begin(), patches_.end(), node,
      [](std::size_t value, const Patch& patch) { return value < patch.first_node; });
  return static_cast<std::size_t>(after - patches_.begin()) - 1;
}

SurfaceGrid::Node SurfaceGrid::node(const Scene& scene, std::size_t patch_index,
                                    std::size_t index) const {
  const Patch& patch = patches_[patch_index];
  const auto local = static_cast<std::uint32_t>(index - patch.first_node);
  if (patch.kind != Kind::vertices) {
    const std::uint32_t stride = patch.ns + 1u;
    return patch_node(scene, patch, static_cast<float>(local % stride) / patch.ns,
                      static_cast<float>(local / stride) / patch.nt);
  }
  const SceneMesh& mesh = scene.meshes[patch.mesh];
  const std::uint32_t where = vertex_triangles_[patch.first_vertex + local];
  Node node;
  node.mesh = patch.mesh;
  node.hit.mesh = patch.mesh;
  node.hit.triangle = where / 3;
  node.hit.u = where % 3 == 1 ? 1.0f : 0.0f;
  node.hit.v = where % 3 == 2 ? 1.0f : 0.0f;
  node.place = mesh.positions[local];
  node.normal = mesh.normals[local];
  return node;
}

SurfaceGrid::Node SurfaceGrid::between(const Scene& scene, const Block& block, float x,
                                       float y) const {
  const Patch& patch = patches_[block.patch];
  const std::uint32_t local = block.first - patch.first_node;
  const auto along = [](std::uint32_t first, float part, std::uint32_t width, std::uint32_t cells) {
    return (static_cast<float>(first) + part * static_cast<float>(width)) /
           static_cast<float>(cells);
  };
  return patch_node(scene, patch, along(local % block.stride, x, block.width, patch.ns),
                    along(local / block.stride, y, block.height, patch.nt));
}

SurfaceGrid::Node SurfaceGrid::patch_node(const Scene& scene, const Patch& patch, float s,
                                          float t) const {
  const SceneMesh& mesh = scene.meshes[patch.mesh];
  Node node;
  node.mesh = patch.mesh;
  node.hit.mesh = patch.mesh;
  const auto place_hit = [&](std::uint32_t triangle, const float* weights) {
    node.hit.triangle = triangle;
    node.hit.u = weights[1];
    node.hit.v = weights[2];
  };
  float weights[3] = {};
  const Vec3f p0 = mesh.positions[patch.corners[0]];
  const Vec3f a = mesh.positions[patch.corners[1]] - p0, b = mesh.positions[patch.corners[2]] - p0;
  Vec3f middle;
  const Triangle& first = triangles_[first_triangle_[patch.mesh] + patch.triangle];
  if (patch.kind == Kind::parallelogram) {
    node.place = p0 + s * a + t * b;
    node.normal = mesh.normals[patch.corners[0]];
    middle = p0 + 0.5f * (a + b);
    const bool second = s + t > 1.0f;
    const Triangle& triangle =
        second ? triangles_[first_triangle_[patch.mesh] + patch.triangle + 1] : first;
    for (int k = 0; k < 3; ++k) {
      const bool at_s = triangle.s_bits >> k & 1, at_t = triangle.t_bits >> k & 1;
      weights[k] = at_s && at_t ? s + t - 1.0f
                   : at_s       ? (second ? 1.0f - t : s)
                   : at_t       ? (second ? 1.0f - s : t)
                                : 1.0f - s - t;
    }
    place_hit(patch.triangle + (second ? 1 : 0), weights);
  } else {
    node.place = p0 + s * ((1.0f - t) * a + t * b);
    const Vec3f normal = (1.0f - s) * mesh.normals[patch.corners[0]] +
                         s * (1.0f - t) * mesh.normals[patch.corners[1]] +
                         s * t * mesh.normals[patch.corners[2]];
    const float length = glm::length(normal);
    node.normal = length > 0.0f ? normal / length : mesh.normals[patch.corners[0]];
    middle = p0 + (a + b) / 3.0f;
    weights[first.apex] = 1.0f - s;
    weights[(first.apex + 1) % 3] = s * (1.0f - t);
    weights[(first.apex + 2) % 3] = s * t;
    place_hit(patch.triangle, weights);
  }
  const Vec3f inwards = middle - node.place;
  const float distance = glm::length(inwards);
  const bool border = s == 0.0f || s == 1.0f || t == 0.0f || t == 1.0f;
  if (border && distance > 0.0f) node.place += inwards * std::min(inset / distance, 0.25f);
  return node;
}

SurfaceGrid::Face SurfaceGrid::face(std::uint32_t mesh, std::uint32_t triangle_index) const {
  const Triangle& triangle = triangles_[first_triangle_[mesh] + triangle_index];
  const Patch& patch = patches_[triangle.patch];
  Face face;
  face.first = patch.first_node;
  if (patch.kind == Kind::vertices) {
    std::copy_n(mesh_indices_[mesh] + 3 * static_cast<std::size_t>(triangle_index), 3, face.corner);
    return face;
  }
  face.stride = patch.ns + 1u;
  face.columns = patch.ns;
  face.rows = patch.nt;
  face.fan = patch.kind == Kind::fan;
  for (int k = 0; k < 3; ++k) {
    const bool at_s = face.fan ? k != triangle.apex : triangle.s_bits >> k & 1;
    const bool at_t = face.fan ? k == (triangle.apex + 2) % 3 : triangle.t_bits >> k & 1;
    face.at[k] = {at_s ? patch.ns : 0.0f, at_t ? patch.nt : 0.0f};
  }
  return face;
}

SurfaceGrid::Lookup SurfaceGrid::lookup(const RayHit& hit) const {
  const Face patch = face(hit.mesh, hit.triangle);
  const float weights[3] = {1.0f - hit.u - hit.v, hit.u, hit.v};
  Lookup out;
  if (patch.columns == 0) {
    for (int k = 0; k < 3; ++k) {
      out.index[k] = patch.first + patch.corner[k];
      out.weight[k] = weights[k];
    }
    out.index[3] = out.index[0];
    out.weight[3] = 0.0f;
    return out;
  }
  const Vec2f at = weights[0] * patch.at[0] + weights[1] * patch.at[1] + weights[2] * patch.at[2];
  const auto columns = static_cast<float>(patch.columns), rows = static_cast<float>(patch.rows);
  const float x = std::clamp(at.x, 0.0f, columns);
  const float y = std::clamp(!patch.fan ? at.y : x > 0.0f ? at.y * columns / x : 0.0f, 0.0f, rows);
  const auto column = std::min(static_cast<std::uint32_t>(x), patch.columns - 1u);
  const auto row = std::min(static_cast<std::uint32_t>(y), patch.rows - 1u);
  const float fx = x - static_cast<float>(column), fy = y - static_cast<float>(row);
  const std::uint32_t stride = patch.stride;
  const std::uint32_t first = patch.first + row * stride + column;
  out.index[0] = first;
  out.index[1] = first + 1;
  out.index[2] = first + stride;
  out.index[3] = first + stride + 1;
  out.weight[0] = (1.0f - fx) * (1.0f - fy);
  out.weight[1] = fx * (1.0f - fy);
  out.weight[2] = (1.0f - fx) * fy;
  out.weight[3] = fx * fy;
  return out;
}

Float4 interpolate(const SurfaceGrid& grid, std::span<const Float4> values, const RayHit& hit) {
  const SurfaceGrid::Lookup lookup = grid.lookup(hit);
  return lookup.weight[0] * values[lookup.index[0]] + lookup.weight[1] * values[lookup.index[1]] +
         lookup.weight[2] * values[lookup.index[2]] + lookup.weight[3] * values[lookup.index[3]];
}

std::array<std::uint32_t, 4> corners(const SurfaceGrid::Block& block) {
  const std::uint32_t below = block.first + block.height * block.stride;
  return {block.first, block.first + block.width, below, below + block.width};
}

Float4 between(std::span<const Float4> values, const SurfaceGrid::Block& block, float x, float y) {
  const auto at = corners(block);
  return (1.0f - y) * ((1.0f - x) * values[at[0]] + x * values[at[1]]) +
         y * ((1.0f - x) * values[at[2]] + x * values[at[3]]);
}

}  // namespace polyhull
