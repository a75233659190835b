// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How far silhouettes agree: the part of each that the hull of the others does not explain.
///
/// The subject lies in the hull H of the other views, so its silhouette S lies in H's. A pixel of S
/// is explained if its ray meets H, that is if some point of the ray projects into all the other
/// silhouettes. Along the ray each of those is a set of intervals (where the ray's image enters and
/// leaves its rings); the ray meets H where all sets overlap (W. Matusik et al., "Image-based
/// visual hulls", SIGGRAPH 2000). No mesh is made, so views can be exchanged and left out cheaply.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "base/rings.h"
#include "rig/camera.h"

namespace polyhull {

/// One camera's picture: what is needed of it. The camera must outlive it.
struct SeenSubject {
  const Camera* camera = nullptr;
  Rings rings;  ///< in pinhole pixels, without distortion
};

/// How much of a silhouette, or of a part of it, the hull of the others leaves unexplained.
struct Unexplained {
  double share = 0.0;  ///< 0..1; 0 where it is empty or so thin that it has no ray
  Vec2 low{}, high{};  ///< the box of it, pinhole pixels
};

/// Rings in the picture of one view, which need not be its silhouette.
struct PicturePart {
  std::size_t view = 0;
  Rings rings;  ///< in pinhole pixels
};

/// For each part, by \p samples rays or a few more or less: what the hull of the other views leaves
/// unexplained of it. Points nearer than a few pixels to its outline are not asked.
///
/// With \p bounds the hull is limited to them and what a camera does not see may be subject;
/// without, what a camera does not see is none (hullbuild's unseen=keep and carve).
std::vector<Unexplained> find_unexplained(const std::vector<SeenSubject>& views,
                                          const std::vector<PicturePart>& parts,
                                          const std::optional<Bounds>& bounds, int samples);

/// The same for each view's silhouette.
std::vector<Unexplained> find_unexplained(const std::vector<SeenSubject>& views,
                                          const std::optional<Bounds>& bounds, int samples);

}  // namespace polyhull
