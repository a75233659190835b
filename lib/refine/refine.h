// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The smooth surface inside a visual hull that touches every silhouette.
///
/// A body touches each silhouette's cone along a rim, and so does its hull; but the hull fills what
/// no camera sees with corners. Wanted is the surface that bends least and still touches: with H
/// the depth inside the hull (hull_distance.h) and contact rays through the outlines
/// (contact_rays.h),
///
///   1. f = H on a grid of twice the cell; blurred and put back at the rims, again and again
///      (flow.h), it shrinks to what rays need, and a thin plate through the rims (plate.h)
///      rounds it;
///   2. from there the same on the grid itself;
///   3. on a grid of half the cell f is fitted to the rims once more and cut at the exact hull
///      (fine_field.h);
///   4. narrow tunnels that no silhouette shows are filled and handles a hair thin cut
///      (pieces/handles.h), and pieces that no silhouette needs are left out (pieces/components.h);
///   5. f = 0 as triangles, as large as its bends and the rims allow (merge/merged_cells.h).
///
/// It depends on this instant's silhouettes only: nothing lags behind what moves.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "hull/camera_contours.h"
#include "hull/hull.h"
#include "refine/photo/view_pixels.h"

namespace polyhull {

enum class RefineQuality {
  off,   ///< the hull as it is
  fast,  ///< fewer steps
  good,
  fine,  ///< two thirds of the cell
};

struct RefineSettings {
  RefineQuality quality = RefineQuality::good;
  double cell =
      0.0;  ///< metres from node to node; the least triangles are half as large; 0: by the quality
  int threads = 0;     ///< of the pool; 0: all
  bool photo = false;  ///< carves what the pictures contradict (photo.h), which takes its time
  bool reuse = true;   ///< false: works as if nothing were known from the last call
  bool operator==(const RefineSettings&) const = default;
};

/// Counts and times (seconds) of one call, for `stats`.
struct RefineStatistics {
  std::uint32_t parts = 0;           ///< of the hull that have a grid of their own
  std::uint32_t rays = 0;            ///< that touch the body
  std::uint32_t thin_rays = 0;       ///< where the hull is too thin for the grid, and was kept
  std::uint32_t pieces_dropped = 0;  ///< of the surface, that no silhouette needs
  std::uint64_t nodes = 0;           ///< of the grids
  bool reused = false;               ///< nothing had changed
  /// Distances, rays, flow, plate, fine grid, triangles.
  double seconds_distances = 0, seconds_rays = 0, seconds_flow = 0, seconds_plate = 0,
         seconds_fine = 0, seconds_surface = 0;
  double seconds_photo = 0;
};

/// Refines hulls one after the other and keeps the memory. Not for use by two threads at once.
class HullRefiner {
 public:
  HullRefiner();
  ~HullRefiner();

  /// The surface inside \p hull (but for a hair at the rims and what is too thin): closed, oriented, a 2-manifold without crossings, with normals, its
  /// faces of no plane (HullFace::no_edge); the same bytes for any number of threads. \p views are
  /// those that the hull was made of, with their contours; \p metres_per_unit of the hull's world.
  /// An empty hull stays empty. The result is valid until the next call; the same input as in the
  /// last call gives the last result at once.
  ///
  /// Throws Error (bad_input) where a vertex, a camera or a contour is not finite, where the unit
  /// or the cell is not above 0, and (unsupported) where the hull is so large that its grid would
  /// have more than 64 million nodes, with the cell that would do, or where nothing is left. What a
  /// camera does not see counts as outside, whatever hullbuild's `unseen` says.
  ///
  /// \p pictures of the views in their order, for RefineSettings::photo, which needs one of each view
  /// (else Error, bad_input); with it nothing is taken from the last call.
  const Hull& refine(const Hull& hull, std::span<const CameraContours> views,
                     double metres_per_unit, const RefineSettings& settings,
                     std::span<const ViewPixels> pictures = {});

  const RefineStatistics& statistics() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace polyhull
