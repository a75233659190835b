// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The vertices of a textured hull as both renderers take them (shaders/hull.vert,
/// processor/skin.h): triangles that face the eye, each with all views that weigh anything on it,
/// since any of them may be among the best of a fragment where others see nothing.
///
/// Most triangles have at most four: these are in their vertices. The wide ones, with more, name a
/// list instead, and follow the narrow ones in the drawing:
///   lists[i] = {n, 0, 0, 0}, lists[i + 1 ... i + n] = {weights at the three corners, slot}
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mesh/mesh.h"
#include "render/subject/view_weights.h"

namespace polyhull {

/// As many views as a mesh may have to be textured.
inline constexpr std::size_t most_candidates = 64;

/// Whether a view has a picture to take colours from.
bool can_colour(const View& view);

/// A triangle's corner, in the layout that OpenGL reads.
struct HullVertex {
  Vec3f position{0.0f};  ///< relative to Hull::origin
  /// 0..65535 for 0..1. Of a wide triangle: 1 at the corner's own place of three, else 0.
  std::array<std::uint16_t, 4> weights{};
  /// Of HullDrawing::views. Of a wide triangle: where its list begins, the lowest byte first.
  std::array<std::uint8_t, 4> slots{};
  /// Where no view counts: linear red, green and blue, 0..65535 for 0..1.
  std::array<std::uint16_t, 4> fill{};
};
static_assert(sizeof(HullVertex) == 32);

/// What is drawn of one hull, for all eyes.
struct HullDrawing {
  std::vector<HullVertex> vertices;   ///< three per triangle
  std::vector<std::uint32_t> corner;  ///< by vertex: that of the hull, or nearest to it
  std::vector<std::array<std::uint16_t, 4>> lists;  ///< of wide triangles
  std::vector<int> views;         ///< by slot: index into Mesh::views; only views that are used
  std::vector<int> slot_of_view;  ///< -1: not used

  /// Nothing is drawn, of so many views.
  void clear(std::size_t count_of_views) {
    vertices.clear(), corner.clear(), lists.clear(), views.clear();
    slot_of_view.assign(count_of_views, -1);
  }
};

/// Where the list of the wide triangle of \p vertex begins.
inline std::uint32_t list_of(const HullVertex& vertex) {
  return vertex.slots[0] | vertex.slots[1] << 8 | vertex.slots[2] << 16 |
         static_cast<std::uint32_t>(vertex.slots[3]) << 24;
}

/// HullVertex::fill of a mesh's vertices: Texturing::fill, or Texturing::untextured for all.
class VertexFill {
 public:
  explicit VertexFill(const Mesh& mesh);
  std::array<std::uint16_t, 4> operator()(std::uint32_t vertex) const;

 private:
  const std::vector<std::uint32_t>* colours_ = nullptr;  // null: all the same
  const std::uint16_t* levels_;                          // by code
  std::array<std::uint16_t, 4> plain_{};
};

/// The sum of a point's weights below which its views' colours fade into the fill: less than the rim
/// of what a single view sees straight, whose colours are better than any fill (soft_edge.h,
/// rim_shares()); where there is but one colour to fade to, next to nothing.
float fill_range(const Mesh& mesh);

/// The slot of view \p view, a new one where it has none.
int slot_of(HullDrawing& drawing, std::size_t view);

/// What a surface of \p normal whose colours are in no picture sends of what it would if it faced the eye,
/// \p to_eye away: an even light is a quarter, a lamp beside the eye the rest. Neither need have length
/// 1.
float shaded_share(const Vec3f& normal, const Vec3f& to_eye);

/// Adds to \p drawing the triangles of \p mesh that face \p eye, with the weights of its
/// texturing's method and metric (view_weights.h). Call once per eye with one
/// drawing to give all of them the same slots; the new vertices follow the old. Without texturing,
/// or where no view sees a triangle, the weights are 0. Views without RGBA pixels are not used. A
/// mesh whose colours are in no picture is shaded, as by a lamp beside the eye: its fill shows form.
/// Returns the number of the first vertex of a wide triangle: they come last.
std::size_t add_hull_vertices(const Mesh& mesh, const MeshEye& eye, HullDrawing& drawing);

}  // namespace polyhull
