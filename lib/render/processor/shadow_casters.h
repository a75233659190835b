// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The subjects as they stand in the main light's way, for all views of the scene.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "imagehull/image_subject.h"
#include "raytrace/ray_caster.h"
#include "render/frame.h"
#include "render/light_reach.h"

namespace polyhull::processor {

class ShadowCasters {
 public:
  /// The subjects that block \p light now, in scene coordinates. \p same: they, and the light, are
  /// those of the last call.
  void set(const RenderPlan& plan, const Light& light, bool same);

  /// Image-based subjects as points of the light see them.
  using Aim = std::vector<ImageHull::Origin>;  // by subject and place
  /// Makes \p places on the light (scene coordinates) ready for occluded().
  Aim aim(std::span<const Vec3f> places) const;

  /// Which rays from a few near places to \p place, which is number \p number of the \p aim, are blocked
  /// (one byte per ray, 0 or 1); at most ImageHull::lanes rays, each as long as its direction.
  void occluded(std::span<const Ray> rays, const Vec3f& place, std::size_t number, const Aim& aim,
                std::span<std::uint8_t> blocked) const;
  /// Where none of them can be blocked.
  const LightReach& reach() const { return reach_; }
  /// Another number than before where places found by reach() are others now.
  std::uint64_t map() const { return map_; }

 private:
  RayCaster caster_{RayCaster::For::one_frame};
  std::optional<std::uint32_t> mesh_;
  LightReach reach_;
  struct Image {
    std::shared_ptr<const ImageSubject> subject;
    Mat4 from_scene{1.0};
  };
  std::vector<Image> images_;
  bool any_triangles_ = false;
  std::uint64_t map_ = 1;
};

}  // namespace polyhull::processor
