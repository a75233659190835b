// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Photo-consistency: hollows that no silhouette shows, carved where the cameras' colours contradict
/// the surface.
///
/// A point of the true surface has one colour in all cameras that see it; a point of a surface that
/// is too large shows each of them another part of what lies behind (Seitz and Dyer, Photorealistic
/// Scene Reconstruction by Voxel Coloring, 1997). For every vertex, at some depths along its inward
/// normal, a small patch of the tangent plane is looked up in the pictures of the most frontal
/// cameras that see the vertex; its agreement is the mean of the normalised cross correlations of
/// all pairs of them. A depth is wanted where the agreement, averaged over neighbours, is clearly
/// better than at the surface, and only where most around want one, too. The depths are then smoothed
/// over the surface, 0 where nothing speaks for a step, and held near 0 beside rims, where the
/// silhouettes say where the surface is. By how much f is lowered, so that it is 0 there, is smoothed
/// as well: f keeps its own smoothness, and no crumb is left between two depths. Nothing moves
/// outwards, and what is plain stays.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hull/camera_contours.h"
#include "refine/field/cell_surface.h"
#include "refine/field/contact_rays.h"
#include "refine/field/flow.h"
#include "refine/field/hull_distance.h"
#include "refine/photo/view_pixels.h"

namespace polyhull::refine {

/// How a surface is carved; lengths in cells.
struct PhotoSettings {
  float step = 0.25f;    ///< from depth to depth
  int steps = 12;        ///< depths beyond 0
  float spacing = 0.3f;  ///< of the patch's points, at least a pixel's width
  float least = 0.8f;    ///< agreement that a depth must have
  float better = 0.15f;  ///< by how much more than at the surface
  float texture = 6.0f;  ///< grey levels that a patch must vary by, standard deviation
  float least_cosine = 0.4f;
  int smoothings = 60;  ///< of the depths
};

/// Carves surfaces and keeps the memory.
class PhotoCarver {
 public:
  /// Takes the pictures of one call; \p cameras, \p pictures and \p views in the same order, all to
  /// outlive the object's use.
  void set_up(std::span<const CameraContours> cameras, std::span<const ViewPixels> pictures,
              std::span<const ContactView> views, int threads);

  /// Lowers f of \p fine, whose surface is \p surface (CellMarcher), where the pictures contradict
  /// it, hardly beside \p rims, and says whether it did anywhere. The same for any number of threads.
  bool carve(Level& fine, const CellSurface& surface, std::span<const Vec3f> rims,
             const PhotoSettings& settings, int threads);

 private:
  /// A picture's luma, and where the surface is in it.
  struct Look {
    const Camera* camera = nullptr;
    const ContactView* view = nullptr;
    bool lens = false;
    int left = 0, top = 0, width = 0, height = 0;
    std::vector<std::uint8_t> luma;
    int across = 0, down = 0;    ///< texels
    float texel = 2.0f;          ///< px
    std::vector<float> inverse;  ///< the largest 1 / depth, 0: nothing

    Vec2f pixel(const Vec3f& point) const;
    bool sees(const Vec3f& point) const;
    /// Whether the silhouette holds a whole patch.
    bool well_inside(const Vec3f& point, const PhotoSettings& settings) const;
  };
  struct Patch;
  struct Candidate;
  static void take_luma(const ViewPixels& picture, Look& look);
  static void draw_depths(const CellSurface& surface, Look& look);
  static void keep_apart(std::vector<Candidate>& asked);
  void find_agreement(const CellSurface& surface, std::uint32_t vertex,
                      const PhotoSettings& settings, float* agreement) const;
  void find_neighbours(const CellSurface& surface);
  void average(std::size_t depths, int threads);
  void choose(const Level& fine, const CellSurface& surface, const PhotoSettings& settings);
  void drop_lonely(int threads);
  void hold(const Grid& grid, const CellSurface& surface, std::span<const Vec3f> rims);
  void smooth(int times, int threads);
  void lower(Level& fine, const CellSurface& surface, int threads);

  std::vector<Look> looks_;
  std::vector<float> agreement_, averaged_;  ///< per vertex and depth; `unknown` where none
  std::vector<std::uint32_t> first_neighbour_, neighbours_;
  std::vector<float> wanted_, weight_, depth_, smoothed_;  ///< per vertex
  FlowMemory flow_memory_;
};

}  // namespace polyhull::refine
