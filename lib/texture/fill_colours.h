// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Colours for what no camera sees, one per vertex: continued over the surface from what is seen.
///
/// Each vertex v that a view sees has a sample s_v with a confidence c_v (fill_samples.h). What is
/// not seen, and the doubtful vertices around it (the open ones), take
///   nearest   the sample at the end of the shortest way over the mesh's edges, which are the longer
///             the more they turn, and to which a doubtful sample's doubt (1 - c_v) adds;
///   inpaint   the solution of  sum_j w_vj (x_v - x_j) + l_v (x_v - s_v) = 0  over the neighbours j,
///             w_vj = 1 / length of the edge as above, l_v = c_v^3 / (1 - c_v) sum_j w_vj: smooth
///             between the samples around, and near them where they are not quite sure. Successive
///             over-relaxation (Young 1954) there and back, ring by ring, from the rings' means.
/// So colours follow the surface: what hides leaves none on what it hides, as samples beside its
/// rim, where the OcclusionMap's fade is low, hardly count.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hull/hull.h"
#include "rig/camera.h"
#include "texture/fill_samples.h"
#include "texture/texture_hull.h"

namespace polyhull {

/// Finds Texturing::fill for one hull after the other. Not for use by two threads at once.
class FillColours {
 public:
  /// The colours of \p hull's vertices: RGBA bytes, sRGB, alpha 255. \p pictures: one per camera,
  /// \p texturing: the hull's. Empty for TextureFill::grey, for an empty hull, and where no
  /// vertex is open. What no way leads to from anything seen, and vertices whose fill is never shown,
  /// take the mean of what is seen, without any Texturing::untextured. The same bytes for any
  /// number of threads.
  std::vector<std::uint32_t> find(const Hull& hull, std::span<const Camera> cameras,
                                  std::span<const FillPicture> pictures, const Texturing& texturing,
                                  const TextureSettings& settings);

 private:
  /// An edge to another open vertex, by its number.
  struct Edge {
    std::uint32_t to;
    float weight;  // 1 / length
  };
  /// What the colour of an open vertex hangs on besides open neighbours.
  struct Open {
    std::uint32_t vertex;
    std::uint32_t first_edge;     // up to the next one's
    Vec3f given{0.0f};            // weighted sum of neighbours with a sample that stays
    float given_weight = 0.0f;    // of it
    float nearest_weight = 0.0f;  // the largest in it
    Vec3f nearest{0.0f};          // whose colour
  };
  void link(const Hull& hull, const Texturing& texturing, float shortest);
  void take_nearest(float doubt);
  void take_means();
  void relax();

  std::vector<FillSample> samples_;  // by vertex
  std::vector<Open> open_;           // by number; one more at the end
  std::vector<std::int32_t> number_;
  std::vector<Edge> edges_;
  std::vector<Vec3f> colours_;        // by number
  std::vector<std::uint8_t> has_;     // by number: whether it has a colour
  std::vector<std::uint32_t> order_;  // numbers, as they got theirs
};

}  // namespace polyhull
