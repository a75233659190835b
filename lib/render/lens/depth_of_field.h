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
#include "rig/camera.h"
#include "scene/viewport_lens.h"

namespace polyhull {

class DepthOfField {
 public:
  static constexpr float most_radius = 64.0f;  ///< pixels

  /// Whether \p lens asks for anything of this.
  static bool wanted(const ViewportLens& lens) { return lens.aperture > 0.0; }

  /// Writes what \p lens makes of \p sharp into \p target, RGBA rows \p target_stride bytes apart, none
  /// of the same memory; alpha as in SharpPictures::full. Light is added up linearly. \p camera is the
  /// pinhole's, of the size of \p depths.
  void apply(const Camera& camera, const ViewportLens& lens, const DepthLayers& depths,
             const SharpPictures& sharp, std::uint8_t* target, int target_stride);

 private:
  static constexpr int tile = 16;          // pixels
  static constexpr int radius_steps = 16;  // to a pixel, of areas

  struct Offset {
    int x, y;
    float distance, share;  // share: of how many pixels it stands for
  };
  void set_pixels(double fx, double fy);
  void find_offsets();
  void find_disks();
  void find_circles(const ViewportLens& lens, float scale, const DepthLayers& depths);
  void find_reach(int width, int height);
  void blur_tile(int column, int row, const SharpPictures& sharp, std::uint8_t* target,
                 int target_stride) const;
  Float4 gather(int x, int y, std::size_t count, bool subject) const;
  Float4 gather_subject(int x, int y, std::size_t count, float& circle) const;
  Float4 gather_even(int x, int y, std::size_t count) const;
  float inverse_area(float radius) const;
  float radius_of(float circle) const;

  /// What a pixel becomes.
  struct Disk {
    float circle;        // c
    float radius;        // as it is drawn
    float inverse_area;  // of that
  };
  static float weight(const Disk& disk, float distance);

  float wide_ = 0.0f, high_ = 0.0f;  // a pixel, in the unit of radii: 1 or more; 0: none made yet
  std::vector<Offset> offsets_;      // by distance
  std::vector<float> inverse_area_;  // of a disk as the offsets see it, by its radius
  std::vector<float> drawn_radius_;  // by the true one
  int width_ = 0, height_ = 0, columns_ = 0, rows_ = 0;
  bool subject_only_ = false;
  LightLayers layers_;
  std::vector<Disk> scene_disks_, subject_disks_;
  // By tile: the largest radius that gets there, whether any of the subject does, and whether the
  // scene's circles are alike as far as that.
  std::vector<float> reach_;
  std::vector<std::uint8_t> near_subject_, even_;
};

}  // namespace polyhull
