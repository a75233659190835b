// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Pictures that disagree, warped onto each other: what PictureFlow holds.
///
/// The surface is not quite the body's, cameras are not quite where their calibration says: two views
/// see the same at two places of it, and a blend shows it twice. For view i and a neighbour j, the
/// other's picture is seen through the surface, from i:  b(x) = I_j(p_j(S_i(x))), with S_i(x) the
/// surface's point at texel x of i's map; flow.h finds d with I_i(x + d) = b(x). A renderer takes view
/// i's colour from x + t_ij d_ij(x), t_ij + t_ji = 1: both meet between them, nearer to the view that
/// is nearer to the eye (render/subject/picture_flows.h).
///
/// After Floating Textures (Eisemann et al. 2008), with flows between the views instead of between
/// their renderings: they hold for all viewports.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "hull/hull.h"
#include "rig/camera.h"
#include "texture/align/flow.h"
#include "texture/fill_samples.h"
#include "texture/texturing.h"

namespace polyhull {

/// Counts of one call, for `stats`.
struct AlignStatistics {
  std::uint64_t flows = 0;         ///< between views that disagree
  std::uint64_t pairs = 0;         ///< of views that were compared
  std::uint64_t pairs_reused = 0;  ///< of these: those of which nothing had changed
};

/// Finds Texturing::flows for one hull after the other and keeps the memory. Not for use by two
/// threads at once.
class PictureAligner {
 public:
  /// The flows between each view and the two nearest to it by angle that see some of the same;
  /// empty where \p texturing has no maps. \p pictures: one per camera. The same bytes for any number
  /// of threads.
  std::vector<PictureFlow> find(const Hull& hull, std::span<const Camera> cameras,
                                std::span<const FillPicture> pictures, const Texturing& texturing,
                                int threads);

  const AlignStatistics& statistics() const { return statistics_; }

 private:
  /// A view's picture on its map's grid, PictureFlow::coarser.
  struct Grid {
    FlowImage image;
    std::vector<float> depth;  ///< of the surface; 0: none
    double x = 0.0, y = 0.0, step = 1.0;
    double tolerance = 0.0;  ///< of depths
    Camera camera;
    bool sees = false;  ///< something of the surface, and has a picture of it
    bool operator==(const Grid&) const = default;
  };
  struct Pair {
    int view = 0, other = 0;
    bool operator==(const Pair&) const = default;
  };
  static PictureFlow compare(const Pair& pair, const Grid& grid, const Grid& other,
                             FlowFinder& finder);
  std::vector<Pair> pairs_of(const Hull& hull) const;
  static void sample(const Camera& camera, const FillPicture& picture, const OcclusionMap& map,
                     Grid& grid);
  static bool reproject(const Grid& grid, const Grid& other, FlowImage& out);

  std::vector<Grid> grids_, last_grids_;
  // Of the last call.
  std::vector<Pair> pairs_;
  std::vector<PictureFlow> found_;                    // by pair
  std::vector<std::unique_ptr<FlowFinder>> finders_;  // that no thread uses
  AlignStatistics statistics_;
};

}  // namespace polyhull
