// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The subjects as they stand in a light's way, for all views of the scene.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "imagehull/image_subject.h"
#include "raytrace/ray_caster.h"
#include "render/frame.h"
#include "render/light_reach.h"
#include "render/processor/light_masks.h"
#include "render/shadow_recipe.h"

namespace polyhull::processor {

/// A frame's subjects that have triangles, ready for rays, for all lights.
class SolidSubjects {
 public:
  /// Other subjects come.
  void forget();
  /// Those of \p plan, unless they are ready. Several threads may call it.
  void make(const RenderPlan& plan);
  /// As RayCaster::occluded(), after make().
  void occluded(std::span<const Ray> rays, std::span<std::uint8_t> blocked) const;

 private:
  RayCaster caster_{RayCaster::For::one_frame};
  std::mutex making_;
  bool made_ = false, any_ = false;
  std::optional<std::uint32_t> mesh_;
};

class ShadowCasters {
 public:
  /// The subjects that block \p light now, in scene coordinates, as \p recipe asks for them; rays meet
  /// \p solid, which must outlive this and is made ready if it is asked. \p same: they, the light and the
  /// recipe are those of the last call.
  void set(const RenderPlan& plan, SolidSubjects& solid, const Light& light,
           const ShadowRecipe& recipe, bool same);

  /// Makes \p places on the light (scene coordinates) ready to be asked for.
  void aim(std::span<const Vec3f> places);

  /// Whether find_hidden() is to be asked, and not occluded().
  bool masked() const { return masked_; }
  /// Sets bit i of \p hidden (one of 0 for each of \p receivers) where subjects hide place \p first + i
  /// of the last aim(), i below \p count.
  void find_hidden(std::size_t first, int count, const MaskPoints& receivers,
                   std::uint32_t* hidden) const;
  /// Which rays from a few near receivers to place \p number are blocked (one byte per ray, 0 or 1); at
  /// most ImageHull::lanes rays, each as long as its direction.
  void occluded(std::span<const Ray> rays, std::size_t number,
                std::span<std::uint8_t> blocked) const;
  /// Where none of them can be blocked.
  const LightReach& reach() const { return reach_; }
  /// Another number than before where places found by reach() are others now.
  std::uint64_t map() const { return map_; }

 private:
  const SolidSubjects* solid_ = nullptr;
  LightReach reach_;
  struct Image {
    std::shared_ptr<const ImageSubject> subject;
    Mat4 from_scene{1.0};
  };
  std::vector<Image> images_;
  std::vector<LightMasks> masks_;  // by subject
  bool masked_ = false;
  std::vector<Vec3f> places_;               // of the last aim(), until the next set()
  std::vector<ImageHull::Origin> origins_;  // by image-based subject and place
  std::uint64_t map_ = 1;
};

}  // namespace polyhull::processor
