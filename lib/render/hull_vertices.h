// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The vertices of a textured hull as both renderers take them (shaders/hull.vert,
/// processor/skin.h): triangles that face the eye, each with the up to four views that weigh most
/// on it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mesh/mesh.h"

namespace polyhull {

/// Whether a view has a picture to take colours from.
bool can_colour(const View& view);

/// A triangle's corner, in the layout that OpenGL reads.
struct HullVertex {
  Vec3f position{0.0f};                    ///< relative to Hull::origin
  std::array<std::uint16_t, 4> weights{};  ///< 0..65535 for 0..1
  std::array<std::uint8_t, 4> slots{};     ///< of HullDrawing::views
  /// Where no view counts: linear red, green and blue, 0..65535 for 0..1.
  std::array<std::uint16_t, 4> fill{};
};
static_assert(sizeof(HullVertex) == 32);

/// What is drawn of one hull, for all eyes.
struct HullDrawing {
  std::vector<HullVertex> vertices;   ///< three per triangle
  std::vector<std::uint32_t> corner;  ///< by vertex: index into Hull::vertices
  std::vector<int> views;             ///< by slot: index into Mesh::views; only views that are used
  std::vector<int> slot_of_view;      ///< -1: not used
};

/// HullVertex::fill of a mesh's vertices: Texturing::fill, or Texturing::untextured for all.
class VertexFill {
 public:
  explicit VertexFill(const Mesh& mesh);
  std::array<std::uint16_t, 4> operator()(std::uint32_t vertex) const;

 private:
  const std::vector<std::uint32_t>* colours_ = nullptr;  // null: all the same
  std::array<std::uint16_t, 4> plain_{};
};

/// The sum of a point's weights below which its views' colours fade into the fill: less than the rim
/// of what a single view sees straight, whose colours are better than any fill (soft_edge.h,
/// rim_shares()); where there is but one colour to fade to, next to nothing.
float fill_range(const Mesh& mesh);

/// The slot of view \p view, a new one where it has none.
int slot_of(HullDrawing& drawing, std::size_t view);

/// Adds to \p drawing the triangles of \p mesh that face the eye at \p eye (mesh world
/// coordinates), with the weights of its texturing's method and metric. Call once per eye with one
/// drawing to give all of them the same slots; the new vertices follow the old. Without texturing,
/// or where no view sees a triangle, the weights are 0. Views without RGBA pixels are not used.
void add_hull_vertices(const Mesh& mesh, const Vec3& eye, HullDrawing& drawing);

}  // namespace polyhull
