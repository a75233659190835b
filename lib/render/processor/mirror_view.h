// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a mirror shows of the scene where the subject's image covers it, so that it can be
/// taken out: a point of the scene that the background itself shows is looked up there, others are
/// lit simply.
#pragma once

#include "render/frame.h"
#include "render/processor/scene/scene_layer.h"

namespace polyhull::processor {

/// The irradiance times exposure that the frame's lamps, taken for points, and its even light give
/// where nothing stands before them; each falls on the surface with a cosine of \p least at least.
Vec3f lamps_irradiance(const RenderFrame& frame, const Vec3f& point, const Vec3f& normal,
                       float least = 0.0f);

class MirrorView {
 public:
  /// \p mirrored is the scene as mirror \p seen of \p plan shows it, drawn wherever shown() is asked.
  /// \p background: RGBA rows \p stride bytes apart, of which \p alpha says whether they may be not
  /// opaque: nothing is looked up there. \p ways: a byte for each pixel of SeenMirror::seen, which stays as
  /// long as \p mirrored does, at first 0. All must outlive this.
  MirrorView(const RenderFrame& frame, const RenderPlan& plan, const SeenMirror& seen,
             const TracedScene& scene, const SceneLayer& mirrored, std::vector<std::uint8_t>& ways,
             const std::uint8_t* background, int stride, AlphaCoding alpha);

  /// The linear picture value that the mirror shows at pixel (x, y), before Fresnel's share. Not for
  /// one pixel by two threads at once.
  Vec3f shown(int x, int y) const;

  /// The share of the subject's image in the mirror at pixel (x, y): Schlick's Fresnel term, of all
  /// mirrors on the way.
  Vec3f share(int x, int y) const;

  /// Whether all mirrors on the way only mirror.
  bool only_mirrors() const { return only_mirrors_; }

 private:
  Vec3f mirrored_way(int x, int y) const;
  Vec3f looked_up(const Vec3f& point, std::uint8_t& way, bool& found) const;

  const RenderFrame& frame_;
  const TracedScene& scene_;
  const SceneLayer& mirrored_;
  std::vector<std::uint8_t>& ways_;
  Rectangle part_;  // of the picture, that these are of
  const std::uint8_t* background_;
  int stride_;
  AlphaCoding alpha_;
  std::vector<MirrorSurface> surfaces_;  // of the way
  Mat4 pixels_from_scene_;
  Vec3f eye_, mirrored_eye_;
  bool only_mirrors_ = false;
  PixelRays rays_;
};

}  // namespace polyhull::processor
