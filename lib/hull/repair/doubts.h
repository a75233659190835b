// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which camera the others contradict: one that has been moved, or whose matte is wrong.
///
/// Silhouettes of one body leave nothing uncovered: the ray of each pixel inside the silhouette of
/// camera k has a stretch that all others see inside theirs (agreement.h). A few pixels inside an
/// outline that holds in spite of the outlines' errors. Where it does not, and the others would
/// have a stretch in common without camera j, j has a vote against it. A camera that is off takes
/// away at the outlines of all others, so their points vote against it; its own unexplained points
/// vote against one or the other.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hull/hull.h"

namespace polyhull {

/// What cameras say of each other; sums over sets.
struct CameraDoubts {
  std::vector<std::uint32_t> asked;        ///< by view: points inside its outlines
  std::vector<std::uint32_t> unexplained;  ///< of these
  std::vector<std::uint32_t> against;  ///< of these: those that view j alone leaves unexplained, at
                                       ///< [view * views + j]
  /// By view: the last point that was unexplained, in pinhole pixels; of no meaning where none was.
  std::vector<Vec2> where;

  /// Both of the same views.
  CameraDoubts& operator+=(const CameraDoubts& other);
  CameraDoubts& operator-=(const CameraDoubts& other);
  /// The share of the other views' points that \p view alone leaves unexplained, without the view
  /// that has most against it: two that contradict each other say nothing of who is wrong.
  double share_against(std::size_t view) const;
  /// The share of all points that is unexplained.
  double share_unexplained() const;
  /// The same of the points of all views but \p without; 1 where they are too few to say.
  double share_unexplained(std::span<const std::size_t> without) const;
};

/// The share of points that may be unexplained where silhouettes are sound.
inline constexpr double sound_share = 0.02;

/// So many pixels inside the outlines the points lie.
inline constexpr double doubt_inset = 2.0;

/// What \p silhouettes (pinhole pixels) say: about \p points points are asked along the outlines of
/// each, round by round others. Nobody is asked where there are fewer than four silhouettes, which
/// cannot tell who is wrong, or more than 64.
CameraDoubts find_doubts(std::span<const Silhouette> silhouettes, Unseen unseen, int points,
                         std::uint32_t round);

/// The view that \p doubts point at: share_against() is at least 1.2 %, and twice any other's. -1:
/// none. Silhouettes within a pixel of the truth come to .3 %.
int doubtful_camera(const CameraDoubts& doubts);

/// The views, at most half of them, whose silhouettes have what no other camera sees (more than 4 %
/// of their points are unexplained, without those that one other view alone leaves so) while the
/// others' points are explained (sound_share): background beside the subject, or grown together with
/// it. A camera that is off takes away from the others, too.
std::vector<std::size_t> views_with_background(const CameraDoubts& doubts);

}  // namespace polyhull
