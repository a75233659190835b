// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A subject's colours: its views ready to be sampled, and the blend of shaders/hull.frag for many
/// points at once.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "mesh/mesh.h"
#include "render/grade.h"
#include "render/processor/loops/loops.h"
#include "render/subject/hull_vertices.h"
#include "render/subject/view_picture.h"
#include "render/subject_light.h"

namespace polyhull::processor {

/// What prepare() did, for statistics.
struct SkinCounts {
  std::uint64_t pictures = 0;          ///< made ready
  std::uint64_t pictures_skipped = 0;  ///< of views that colour nothing visible
  std::uint64_t pixels = 0;
};

/// A point of a subject to be coloured. One of a wide triangle (subject/hull_vertices.h) takes several items, one
/// after the other, that have four of its views each.
struct SkinItem {
  Vec3f place{0.0f};               ///< local coordinates
  float depth = 0.0f;              ///< before the viewport, mesh units
  std::array<float, 4> weights{};  ///< of the candidates
  Vec3f fill{0.0f};                ///< the colour where no view counts, linear
  float share = 0.0f;              ///< how much of its pixel a point is
  std::uint32_t slots = 0;         ///< the candidates, one byte each
  std::uint32_t pixel = 0;         ///< where its colour goes
  std::uint32_t parts = 1;         ///< items of the point that begins here; 0: none does
  std::uint32_t unused = 0;
};
static_assert(sizeof(SkinItem) == 64, "as Loops::spread() takes records");

/// Points of one subject.
struct SkinItems : std::vector<SkinItem> {
  std::size_t first_of_ribbon =
      0;  ///< from here on they are points of ribbons (subject/soft_edge.h)
  /// Whether what no view sees takes the colours that the views have there all the same, so that the
  /// fill is only for what no view has a picture of.
  bool nearest_where_unseen = false;
  std::vector<Vec3f> form;  ///< by item, of a relit subject: by what its colours are multiplied

  void forget() {
    clear();
    form.clear();
    nearest_where_unseen = false;
  }
};

/// What becomes of a subject's colours in the scene.
class SkinLight {
 public:
  SkinLight() = default;
  /// Colours are multiplied by \p lattice (null: 1 everywhere), then graded.
  SkinLight(std::shared_ptr<const LightLattice> lattice, const Mat4& scene_from_local,
            const Grade& grade);

  /// Changes the colours of \p points, local coordinates.
  void shade(const SkinPoints& points, float* red, float* green, float* blue) const;

 private:
  std::shared_ptr<const LightLattice> lattice_;
  glm::mat4 cells_from_local_{1.0f};
  Grade grade_;
  bool graded_ = false;
};

/// A thread's working memory. Points that the same views may colour are coloured side by side, in blocks
/// of at most a few hundred.
struct SkinScratch {
  static constexpr std::size_t block = 256;
  /// Such points, places begin to end - 1 of `order`, whose number is a multiple of 8: the last one is
  /// repeated.
  struct Group {
    std::uint32_t first;  ///< item
    std::size_t count, begin, end;
  };
  /// Points of one group that follow each other.
  struct Run {
    std::uint32_t first, count, group;
  };
  std::vector<Group> groups;
  std::vector<Run> runs;
  std::vector<std::uint32_t> order;  ///< items
  std::vector<glm::vec4> colours;    ///< by item
  // Of a block.
  float x[block], y[block], z[block], depth[block];
  float red[block], green[block], blue[block], share[block];
  float from_u[block], from_v[block], moved_u[block], moved_v[block], moved_share[block];
  /// A view that may colour it, and what of its points: rows of numbers.
  struct View {
    std::uint32_t slot, candidate;
    float *weight, *u, *v, *alpha;
  };
  std::vector<View> views;      ///< the order of their weights is that of the items
  std::vector<float*> weights;  ///< views' own
  std::vector<float> rows;      ///< four for each candidate
};

/// One subject's views and triangles; kept from frame to frame.
class Skin {
 public:
  /// Makes \p mesh's views ready for the eyes in \p eyes (mesh world coordinates), whose pixels
  /// measure \p pixel_size at depth 1. \p same: the mesh is the one of the last call, so that
  /// pictures stay. \p all_views: also those that colour nothing visible (skipping off).
  /// \p soft: the first eye sees a soft edge (subject/soft_edge.h). \p others: views that points of no triangle
  /// take colours from (image_layer.h); slot i is the i-th of them.
  SkinCounts prepare(const Mesh& mesh, const std::vector<Vec3>& eyes, double pixel_size, bool same,
                     bool all_views, bool soft, std::span<const int> others = {});

  /// PlacedSubject::form of the mesh that is ready.
  void relight(const std::vector<Vec3f>& form) { form_ = form; }
  bool relit() const { return !form_.empty(); }
  Vec3f form(std::size_t index) const { return form_[drawing_.corner[index]]; }

  /// The triangles that eye \p eye sees, three vertices each.
  std::size_t first_vertex(std::size_t eye) const { return first_[eye]; }
  std::size_t last_vertex(std::size_t eye) const { return first_[eye + 1]; }
  /// The ribbons' triangles, for the first eye.
  std::size_t first_of_ribbon() const { return first_.back(); }
  std::size_t last_of_ribbon() const { return drawing_.vertices.size(); }
  /// Vertex \p index; a triangle's three follow each other in memory.
  const HullVertex& vertex(std::size_t index) const { return drawing_.vertices[index]; }
  /// Whether the triangles at two vertices have a corner in common; those of ribbons have none.
  bool joined(std::size_t first, std::size_t other) const {
    if (first >= first_of_ribbon() || other >= first_of_ribbon()) return false;
    const std::uint32_t *a = &drawing_.corner[first], *b = &drawing_.corner[other];
    bool any = false;
    for (int i = 0; i < 3; ++i) any = any || a[i] == b[0] || a[i] == b[1] || a[i] == b[2];
    return any;
  }
  /// Whether the triangle at vertex \p index, of an eye's, is wide.
  bool wide(std::size_t index) const;
  /// The views of a wide triangle, of which \p vertex is one.
  std::span<const std::array<std::uint16_t, 4>> list(const HullVertex& vertex) const {
    const std::size_t first = list_of(vertex);
    return {&drawing_.lists[first + 1], drawing_.lists[first][0]};
  }

  /// Adds each item's linear colour times its share (and the share as fourth number) to its pixel.
  void paint(const SkinItems& items, const SkinLight& light, SkinScratch& scratch,
             glm::vec4* pixels) const;

 private:
  struct Picture {
    bool ready = false;
    std::vector<std::uint32_t> pixels;
    std::vector<SmallerPicture> smaller;
    std::vector<SkinTexel> map;  // as SkinView::map
  };
  void find_vertices(const Mesh& mesh, const std::vector<Vec3>& eyes, bool soft,
                     std::span<const int> others);
  void prepare_picture(const Mesh& mesh, int view);
  void add_smaller(const Mesh& mesh, int view, int levels);
  SkinView look_through(const Mesh& mesh, int view) const;
  void look_along(const Mesh& mesh, const Vec3& eye);
  void find_groups(const SkinItems& items, SkinScratch& scratch) const;
  void paint_block(const SkinItems& items, const SkinLight& light, const std::uint32_t* which,
                   int count, SkinScratch& scratch) const;
  void look(const SkinItems& items, const std::uint32_t* which, int count,
            SkinScratch& scratch) const;
  void displace(const SkinScratch::View& view, int count, SkinScratch& scratch) const;

  HullDrawing drawing_;
  std::vector<Vec3f> form_;                      // by vertex of the hull; empty: not relit
  std::vector<std::size_t> first_, first_wide_;  // by eye
  std::vector<Picture> pictures_;                // by view
  std::vector<std::vector<SkinView>> views_;     // by slot and level (subject/view_picture.h)
  std::vector<Mat3f> colours_;                   // by slot: colour_of()
  std::vector<std::vector<SkinFlow>> flows_;     // by slot
  double pixel_size_ = 0.0;
  float tolerance_ = 0.0f;
  int reach_ = 0;             // to which pictures_ are continued
  std::vector<float> rests_;  // by view: SkinView::rest
  bool use_maps_ = false;
  int best_ = 2;
  float fill_range_ = 0.0f;
};

}  // namespace polyhull::processor
