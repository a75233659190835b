// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What subjects hide of soft light from all around: for each a bit image for each of the directions from which
/// the light comes, of its triangles.
///
/// The directions are those of the sides of a cube around the subject, so large that one direction of it is
/// the same from all places near. Each side is an area light of which LightMasks knows what the subject
/// hides: it is cut into sections once for each side, not once for each direction. The images are as exact
/// as the cube is small: each subject has its own, however far apart they stand.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "environment/environment.h"
#include "render/frame.h"
#include "render/light_reach.h"
#include "render/processor/light_masks.h"
#include "render/processor/scene/receivers.h"

namespace polyhull::processor {

/// Points in scene coordinates.
struct SoftPoints {
  std::vector<float> x, y, z;
};

class SoftMasks {
 public:
  /// So many sets of directions, each from all around, which together are all: RenderFrame::soft_light.
  static constexpr int sets = 16;
  static constexpr std::size_t most = max_soft_parts / sets;  ///< of a set
  static constexpr std::size_t sides = 6;
  using Parts = std::shared_ptr<const std::vector<EnvironmentPart>>;

  /// The directions of \p parts, of which there is at least one, for the subjects of \p plan. \p same: these
  /// are those of the last call. cut() is to be called for each side after it.
  void set(const RenderPlan& plan, const Parts& parts, bool same);
  /// Other subjects come.
  void forget() { parts_.reset(); }
  /// Cuts the subjects into sections for a side. Several threads may, each another.
  void cut(const RenderPlan& plan, std::size_t side);
  /// Makes the images, unless they are.
  void aim();

  /// Another number than before where the directions are others.
  std::uint64_t directions() const { return directions_; }
  /// Another number than before, and not 0, where anything is.
  std::uint64_t generation() const { return generation_; }
  std::span<const EnvironmentPart> set_of(int set) const {
    return set_[static_cast<std::size_t>(set)];
  }

  /// Whether any of the subjects reaches above the surface of \p receiver.
  bool may_hide(const Receiver& receiver) const;

  /// Sets bit i of \p hidden (0 before) for each of \p points from which subjects hide
  /// direction i of \p set.
  void find_hidden(int set, const SoftPoints& points, std::uint64_t* hidden) const;

 private:
  /// A subject before a side of its cube.
  struct Hider {
    LightReach reach;
    LightMasks masks;
    bool any = false;  // whether the masks are to be asked
  };
  struct Side {
    std::vector<Vec3f> ways;                    // directions, by set
    std::array<std::size_t, sets + 1> first{};  // of these, by set
    std::vector<Hider> hiders;                  // by subject
    bool cut = false;
  };
  struct Ball {
    Vec3f centre{0.0f};
    float radius = 0.0f;
    float distance = 0.0f;  // from the centre to the cube's sides
  };
  void choose_directions();

  Parts parts_;
  std::uint64_t directions_ = 0, generation_ = 0;
  std::array<std::vector<EnvironmentPart>, sets> set_;  // each by side
  std::array<Side, sides> sides_;
  std::vector<Ball> balls_;  // around the subjects
  bool aimed_ = false;
};

}  // namespace polyhull::processor
