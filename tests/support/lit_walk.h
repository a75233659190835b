// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The true figure on a walk through the built-in room, below the lamp, into the pillar's shadow and a dark
/// corner, and its colours there as composite's `light` makes them and as paths find them. Each is as
/// bright as the studio in the stage's middle.
#pragma once

#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "base/vector.h"
#include "raytrace/traced_scene.h"
#include "render/frame.h"
#include "render/subject_light.h"

namespace polyhull::synthetic {

struct Stop {
  const char* name;
  Vec3 place;
  double seconds;
};
inline constexpr double far_corner = 2.35;
inline const std::array<Stop, 7> walk_stops = {
    {{"middle", {0, 0, 0}, 0.0},
     {"below the lamp", {0.45, 0, 0.35}, 0.5},
     {"towards the pillar", {-0.9, 0, 0.6}, 1.0},
     {"its shadow's border", {-1.5, 0, 1.55}, 1.5},
     {"its shadow", {-1.85, 0, 1.35}, 2.0},
     {"dark wall", {-2.2, 0, -0.5}, 2.5},
     {"dark corner", {far_corner, 0, -far_corner}, 3.0}}};

/// Colours of the figure, linear picture values.
enum class WalkKind {
  off,    ///< the studio's
  shade,  ///< that times what SubjectLight finds there
  form,  ///< light=relit with relight=1: shade times what find_forms() finds at the mesh's vertices
  known,  ///< the same over the studio's own light, as if that were known instead of even
  clear,  ///< known, as if the body hid nothing of its own light
  even,   ///< the studio's times the same as shade found by paths: what shade approximates
  open,  ///< what the room makes of the figure's albedo by paths that end on it with its normals and go
         ///< through it: what clear approximates
  relit,  ///< the same where it shadows itself: what known approximates
};

class LitWalk {
 public:
  /// Pictures of \p width x \p height pixels, and \p paths of each pixel.
  LitWalk(int width, int height, std::uint32_t paths);

  /// The figure's pixels at a stop: which, and their colours by kind. Those of paths only of \p kinds.
  struct Shown {
    std::vector<int> pixels;
    std::array<std::vector<Vec3f>, 8> colours;
    const std::vector<Vec3f>& operator[](WalkKind kind) const {
      return colours[static_cast<std::size_t>(kind)];
    }
  };
  Shown at(const Stop& stop, const std::vector<WalkKind>& kinds);

 private:
  int width_, height_;
  std::uint32_t paths_;
  std::shared_ptr<const Scene> scene_;
  TracedScene traced_;
  Vec3f stage_{0.0f};
  RenderFrame frame_;
  SubjectLight light_;
};

/// PSNR in dB of linear picture values as sRGB codes.
double psnr_of_codes(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b);

}  // namespace polyhull::synthetic
