// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Depth of field, from a sharp picture in two layers.
///
/// A lens of diameter A that is focused at depth F shows a point at depth z as a disk: the rays through
/// the lens meet in a picture whose pixels are f to a depth (f the focal length in pixels) in a disk of
/// the radius |c|,
///
///   c = A f (1/z - 1/F) / 2,       positive where the point is nearer than what is sharp
///
/// which is what raytrace/path_tracer.h traces. Here each pixel gathers the pixels q around it whose
/// disks reach it, w(q) = 1 / area of q's disk, its border one pixel wide. They go into layers, front
/// to back, of which those behind are seen as far as those in front leave something:
///
///   F, what stands before this pixel's surface; M, that surface; K, what is seen behind it within
///   its own disk: it stands for what it hides
///   scene   = F + (1 - sum F) (M + (1 - sum M) mean K)
///   picture = N + (1 - sum N) (S + (1 - s) scene)      N: of the scene what stands before the
///                                                      subject; S the subject, s its coverage
///
/// Before and behind are shares of 0 to 1 that grow with the difference of the c's, so that
/// surfaces that lean are not cut into pieces. The subject's layer comes apart from the scene's: what it
/// hides is known, so that its blurred border is transparent. With ViewportLens::subject_only the scene's
/// disks are pixels. What the scene's own things hide is not
/// known and is made up from what is beside it.
///
/// Where all circles around a pixel are alike, and no subject is near, nothing is before or behind, and
/// the sum over M is all of it.
///
/// Pixels need not be square: radii and distances count in those along the side on which f is larger,
/// and the disk is an ellipse of pixels.
///
/// Disks above `most_radius` count as that large. Pixels up to 4.5 from the middle are all looked at;
/// 48 in each doubling of the radius beyond.
#pragma once

#include <cstdint>
#include <vector>

#include "render/lens/light_layers.h"
#include "render/lens/loops/focus_loops.h"
#include "rig/camera.h"
#include "scene/viewport_lens.h"

namespace polyhull {

class DepthOfField {
 public:
  static constexpr float most_radius = 64.0f;  ///< pixels

  /// Whether \p lens asks for anything of this.
  static bool wanted(const ViewportLens& lens) { return lens.aperture > 0.0; }

  /// Makes of \p sharp what \p lens makes of it. \p camera is the pinhole's, of the size of \p depths.
  /// The subject's layer of \p focused is what it adds to the scene's there, so that both may be moved
  /// apart; where not \p layered, the scene's is the picture.
  void apply(const Camera& camera, const ViewportLens& lens, const DepthLayers& depths,
             const LightLayers& sharp, bool layered, LightLayers& focused);

 private:
  static constexpr int tile = lens::focus_row;  // pixels
  static constexpr int radius_steps = 16;       // to a pixel, of areas

  struct Offset {
    int x, y;
    float distance, share;  // share: of how many pixels it stands for
  };
  /// What pixels become (focus_loops.h).
  struct Disks {
    std::vector<float> circle, radius, inverse_area;
    void resize(std::size_t count);
  };
  struct Around;
  void set_pixels(double fx, double fy);
  void find_offsets();
  void find_tables();
  void find_disks(const ViewportLens& lens, float scale, const DepthLayers& depths,
                  const LightLayers& sharp);
  void find_reach();
  void blur_tile(int column, int row, const LightLayers& sharp, bool layered,
                 LightLayers& focused) const;
  float inverse_area(float radius) const;
  float radius_of(float circle) const;
  lens::DiskTables tables() const {
    return {drawn_radius_.data(), inverse_area_.data(), radius_steps, most_radius};
  }

  float wide_ = 0.0f, high_ = 0.0f;  // a pixel, in the unit of radii: 1 or more; 0: none made yet
  std::vector<Offset> offsets_;      // by distance
  std::vector<float> inverse_area_;  // of a disk as the offsets see it, by its radius
  std::vector<float> drawn_radius_;  // by the true one
  int width_ = 0, height_ = 0, columns_ = 0, rows_ = 0;
  bool subject_only_ = false;
  Disks scene_disks_, subject_disks_;
  // By tile: its largest radius, of the subject -1 where it has none, and the scene's circles.
  std::vector<float> radius_, subject_radius_, nearest_, farthest_;
  // By tile: the largest radius that gets there, whether any of the subject does, and whether the
  // scene's circles are alike as far as that.
  std::vector<float> reach_;
  std::vector<std::uint8_t> near_subject_, even_;
};

}  // namespace polyhull
