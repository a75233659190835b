// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The planar mirrors in which a picture shows subjects, each seen by the eye itself or in another mirror:
/// one by one they are viewports of their own, from the eye's image behind them, and each pixel's
/// samples belong to one of them at most.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/vector.h"
#include "render/projection.h"
#include "scene/scene.h"

namespace polyhull {

/// Of how many mirrors a picture shows the subjects at most: of more, those in which they are largest.
inline constexpr std::size_t most_mirrors = 8;
/// Of how many of a scene's mirrors anything is known, the first ones: a byte says which, or that none.
inline constexpr std::size_t most_known_mirrors = 255;

/// A mirror in which subjects, or their shadow, may be seen.
struct SeenMirror {
  std::vector<std::size_t> way;  ///< into Scene::mirrors: by way of which it is seen, itself last
  int within = -1;               ///< which of the others shows it; -1: the eye sees it
  std::size_t sight = 0;         ///< which of eyes_on() looks through it; 0: no subject is seen
  Mat4 turned{1.0};              ///< takes the scene to where it seems to be
  Vec3 eye{0.0};                 ///< the eye's image, which sees the scene where it is
  PixelRays rays;                ///< from there, through the picture's pixels
  Rectangle seen;                ///< the pixels in which it may be seen
  Rectangle image, shadow;       ///< in which it may show the subjects, and their shadow
};

/// Who looks for mirrors.
struct MirrorSearch {
  const Scene& scene;
  Mat4 clip_from_scene{1.0};
  Vec3 eye{0.0};
  PixelRays rays;
  int width = 0, height = 0;
  int depth = 1;  ///< by way of so many mirrors at most
  bool skip =
      true;  ///< leave images empty of which no pixel is seen; else they are the whole picture
  std::vector<std::span<const Vec3f>> subjects;  ///< their points, scene coordinates
  const std::vector<bool>& left_out;             ///< as RenderFrame::mirrors_left_out
};

/// The mirrors whose part of the picture overlaps the subjects' image, the most_mirrors largest images with
/// those that show them, each after the one that shows it; SeenMirror::shadow is left empty. Of more than
/// 256 mirrors that are seen, one in another, those by way of the fewest others are tried.
std::vector<SeenMirror> find_seen_mirrors(const MirrorSearch& search);

const Mirror& mirror_of(const Scene& scene, const SeenMirror& seen);

/// The plane of \p mirror, moved a hair to its front so that the mirror does not show itself: what is
/// seen in it lies on the positive side of dot(xyz, X) + w = 0, scene coordinates.
Vec4 kept_side(const Mirror& mirror);

/// A mirror's surface on the way to another.
struct MirrorSurface {
  Vec3f normal{0.0f};  ///< as the mirror seems to stand
  Vec3f f0{0.0f};      ///< Material::f0()
};

/// Those of \p seen's way: of the light that it shows, what all of them reflect comes to the eye.
std::vector<MirrorSurface> surfaces_of(const Scene& scene, const SeenMirror& seen);

/// Whether all of them only mirror (Material::only_mirrors()).
bool only_mirrors(const Scene& scene, const SeenMirror& seen);

}  // namespace polyhull
