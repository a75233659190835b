// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Motion blur of a viewport that moves while its shutter is open, from a sharp picture in two layers.
///
/// A point that is seen at pixel u with the inverse depth w was, at the frame before, at
///
///   u' ~ A (u, 1) + w b,     A = K' R' R^T K^-1,   b = K' (t' - R' R^T t)
///
/// so that it moves by v(u, w) = u - u' from frame to frame. The shutter is open for the share s of
/// that time, half of it before the frame's instant: the picture is the mean over tau in
/// [-s/2, s/2] of pictures in which each point lies at u + tau v. What of a layer is then seen
/// at pixel p is at q with q + tau v(q, w(q)) = p, which is looked for by fixed-point
/// iteration from the depth at p and, where their motions differ by a pixel, from the nearest and
/// the farthest around; of those that arrive, the nearest is what is seen. Where none does, a thing
/// has uncovered what the picture does not show, and what lies beside it stands for it. Where motions
/// of neighbours are alike, there is but one q, and it is found for tau = -s/2 and s/2 alone: in
/// between it lies on the parabola through both and p.
///
/// Motion is a straight line at even speed, and the scene and its subjects stand still in it: a person's
/// own motion is blurred in the pictures of the cameras that saw it.
#pragma once

#include <cstdint>
#include <vector>

#include "render/lens/light_layers.h"
#include "render/lens/loops/motion_loops.h"
#include "rig/camera.h"

namespace polyhull {

class MotionBlur {
 public:
  static constexpr float most_motion = 64.0f;  ///< pixels; what moves by more is blurred by that

  struct Shutter {
    Camera before;              ///< the viewport at the frame before, a pinhole of the same size
    double share = 0.0;         ///< of the time from that frame to this, in which light comes in
    bool subject_only = false;  ///< the background's picture has its motion blur already
  };

  /// Whether \p camera is another one than \p before, \p frames frames' time ago, both with pictures of
  /// one size: the middle of the picture, or what is 3 m away there, has moved by more than half the
  /// picture's width, or the viewport has turned by more than 15 degrees, as between cameras that look
  /// at one subject. Both grow with the frames, to twice that: beyond, cameras of a rig are not told from
  /// fast pans.
  static bool is_cut(const Camera& camera, const Camera& before, double frames);

  /// Whether \p camera moves with \p shutter so that it can be seen. A cut is to be kept from here.
  static bool moves(const Camera& camera, const Shutter& shutter);

  /// Makes of \p sharp what the open shutter makes of it: one layer, the scene's. \p camera is the
  /// pinhole's, of the size of \p depths.
  void apply(const Camera& camera, const Shutter& shutter, const DepthLayers& depths,
             const LightLayers& sharp, LightLayers& moved);

 private:
  static constexpr int tile = 16;                // pixels
  static constexpr int cell = lens::motion_row;  // pixels

  /// What moves how, near a tile.
  struct Reach {
    float motion = 0.0f;                    // the longest, in pixels, of the shutter's time
    float nearest = 0.0f, farthest = 1e9f;  // 1/z of the scene
    float parallax = 0.0f;                  // how much their motion differs, in pixels
    bool subject = false;
  };
  struct Motions {
    std::vector<float> x, y;
  };
  void find_motions();
  void spread_subject(const LightLayers& sharp);
  void find_torn();
  void find_own(int column, int row, const LightLayers& sharp);
  void find_reach();
  Vec2f motion_at(const Vec2f& u, float inverse) const;
  bool smooth(int column, int row, float motion) const;
  void blur_tile(int column, int row, const LightLayers& sharp, LightLayers& moved) const;

  lens::MotionMap map_{};
  bool subject_only_ = false;
  int width_ = 0, height_ = 0;
  const float* scene_inverse_ = nullptr;
  Motions scene_motions_, subject_motions_;
  // 1/z, beyond the outline that of the nearest pixel in it along the row, else along the column; where
  // the subject may come to.
  std::vector<float> subject_inverse_;
  Rectangle part_;
  std::vector<char> torn_;  // by cell: neighbours in the scene move otherwise
  int columns_ = 0, rows_of_tiles_ = 0;
  std::vector<Reach> own_, reach_;
};

}  // namespace polyhull
