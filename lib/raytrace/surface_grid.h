// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A grid of nodes over the surfaces of a scene, for values that vary smoothly over them.
///
/// Each pair of triangles that make a flat parallelogram p + s a + t b carries ns x nt cells; each
/// other large triangle is taken as a parallelogram with one side shrunk to its apex, p + s ((1 -
/// t) a + t b), the apex opposite its shortest edge, so that long thin triangles need few nodes;
/// triangles smaller than a cell use the mesh's vertices. Between the nodes values are bilinear
/// (linear in small triangles).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "raytrace/float4.h"
#include "raytrace/ray_caster.h"
#include "scene/scene.h"

namespace polyhull {

class SurfaceGrid {
 public:
  /// Cells of about \p spacing metres; coarser where the scene would have more than \p most_nodes.
  SurfaceGrid(const Scene& scene, float spacing, std::size_t most_nodes);

  struct Node {
    Vec3f place{0.0f};   ///< a hair inside the surface's edge
    Vec3f normal{0.0f};  ///< unit length, on the front
    std::uint32_t mesh = 0;
    RayHit hit;  ///< a hit at the node: mesh, triangle, u and v
  };

  std::size_t size() const { return node_count_; }
  float spacing() const { return spacing_; }

  /// Calls visit(index, node) for nodes begin .. end - 1 in order.
  template <typename Visit>
  void for_nodes(const Scene& scene, std::size_t begin, std::size_t end, const Visit& visit) const {
    std::size_t patch = patch_of(begin);
    for (std::size_t i = begin; i < end; ++i) {
      while (i >= first_node(patch + 1)) ++patch;
      visit(i, node(scene, patch, i));
    }
  }

  /// The nodes whose values make the value at a hit: value = sum weight[k] * values[index[k]].
  struct Lookup {
    std::uint32_t index[4];
    float weight[4];
  };
  Lookup lookup(const RayHit& hit) const;

  /// Where a triangle's values are. On a grid, node (column, row) has the index first + row *
  /// stride + column, and a point of the triangle the place (x, y) in cells: the corners' `at`
  /// weighted as the point; in a fan y is then divided by x / columns. Otherwise the corners have
  /// the nodes first + corner[k].
  struct Face {
    std::uint32_t first = 0, stride = 0, columns = 0, rows = 0;  ///< columns 0: no grid
    std::uint32_t corner[3] = {};
    Vec2f at[3] = {Vec2f(0.0f), Vec2f(0.0f), Vec2f(0.0f)};
    bool fan = false;
  };
  Face face(std::uint32_t mesh, std::uint32_t triangle) const;

  /// A block of nodes of one patch: columns 0 .. width and rows 0 .. height, node (s, t) at
  /// first + t * stride + s.
  struct Block {
    std::uint32_t first, stride, width, height;
    std::uint32_t patch;
  };

  /// A node between those of a block: \p x and \p y from 0 to 1 over its width and height.
  Node between(const Scene& scene, const Block& block, float x, float y) const;

  /// Calls visit(block) for blocks of at most \p step x \p step cells that tile the grid patches;
  /// neighbouring blocks share nodes. Nodes at vertices of small triangles are in no block.
  template <typename Visit>
  void for_blocks(std::uint32_t step, const Visit& visit) const {
    for (std::uint32_t i = 0; i < patches_.size(); ++i) {
      const Patch& patch = patches_[i];
      if (patch.kind == Kind::vertices) continue;
      const std::uint32_t stride = patch.ns + 1u;
      for (std::uint32_t t = 0; t < patch.nt; t += step) {
        for (std::uint32_t s = 0; s < patch.ns; s += step) {
          visit(Block{patch.first_node + t * stride + s, stride, std::min(step, patch.ns - s),
                      std::min(step, patch.nt - t), i});
        }
      }
    }
  }

  /// Calls visit(begin, end) for each range of nodes that are in no block.
  template <typename Visit>
  void for_vertex_ranges(const Visit& visit) const {
    for (std::size_t i = 0; i < patches_.size(); ++i)
      if (patches_[i].kind == Kind::vertices) visit(first_node(i), first_node(i + 1));
  }

 private:
  enum class Kind : std::uint8_t { parallelogram, fan, vertices };
  struct Patch {
    std::uint32_t first_node = 0;
    std::uint32_t mesh = 0;
    std::uint32_t corners[4] = {};   // vertices at (s, t) = (0,0) (1,0) (0,1); fan: apex, a, b
    std::uint32_t triangle = 0;      // the (first) triangle in its mesh
    std::uint32_t first_vertex = 0;  // vertices: into vertex_triangles_
    std::uint16_t ns = 0, nt = 0;
    Kind kind = Kind::vertices;
  };
  /// Where a triangle finds its values.
  struct Triangle {
    std::uint32_t patch = 0;
    std::uint8_t apex = 0;    // fan: which corner
    std::uint8_t s_bits = 0;  // parallelogram: bit k is s at corner k
    std::uint8_t t_bits = 0;
  };

  void lay_out(const Scene& scene, float spacing);
  bool can_be_coarser() const;
  bool add_parallelogram(const SceneMesh& mesh, std::uint32_t mesh_index, std::size_t triangle,
                         float spacing);
  void add_fan(const SceneMesh& mesh, std::uint32_t mesh_index, std::size_t triangle,
               float spacing);
  void add_patch(Patch patch);
  std::size_t patch_of(std::size_t node) const;
  std::size_t first_node(std::size_t patch) const {
    return patch < patches_.size() ? patches_[patch].first_node : node_count_;
  }
  Node node(const Scene& scene, std::size_t patch, std::size_t index) const;
  Node patch_node(const Scene& scene, const Patch& patch, float s, float t) const;

  float spacing_ = 0.0f;
  std::size_t node_count_ = 0;
  std::vector<Patch> patches_;
  std::vector<Triangle> triangles_;                 // of all meshes
  std::vector<std::uint32_t> vertex_triangles_;     // 3 * a triangle + its corner, by vertex node
  std::vector<std::size_t> first_triangle_;         // by mesh
  std::vector<const std::uint32_t*> mesh_indices_;  // by mesh, into the scene it was made from
};

/// The value at a hit of \p values at the grid's nodes.
Float4 interpolate(const SurfaceGrid& grid, std::span<const Float4> values, const RayHit& hit);

/// The nodes at a block's corners, row by row.
std::array<std::uint32_t, 4> corners(const SurfaceGrid::Block& block);

/// The value between a block's corners, \p x and \p y from 0 to 1.
Float4 between(std::span<const Float4> values, const SurfaceGrid::Block& block, float x, float y);

}  // namespace polyhull
