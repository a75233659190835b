// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What subjects hide of soft light from all around: a bit image for each of the directions from which it
/// comes, of all subjects' triangles.
///
/// The directions are those of the sides of a cube around the subjects, so large that one direction of it is
/// the same from all places near them. Each side is an area light of which LightMasks knows what subjects
/// hide: they are cut into sections once for each side, not once for each direction.
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
  std::span<const EnvironmentPart> set_of(int set) const {
    return set_[static_cast<std::size_t>(set)];
  }

  /// Whether any of the subjects reaches above the surface of \p receiver.
  bool may_hide(const Receiver& receiver) const;

  /// Sets bit i of \p hidden (0 before) for each of \p points, scene coordinates, from which subjects hide
  /// direction i of \p set.
  void find_hidden(int set, std::span<const Vec3f> points, std::uint64_t* hidden) const;

 private:
  struct Side {
    Light light;
    LightReach reach;
    std::vector<LightMasks> masks;              // by subject
    std::vector<std::uint8_t> any;              // by subject: whether its masks are to be asked
    std::vector<Vec3f> places;                  // by set
    std::array<std::size_t, sets + 1> first{};  // of places, by set
    bool cut = false;
  };
  struct Ball {
    Vec3f centre{0.0f};
    float radius = 0.0f;
  };
  void choose_directions();
  void place(const Bounds& people);

  Parts parts_;
  std::uint64_t directions_ = 0;
  std::array<std::vector<EnvironmentPart>, sets> set_;  // each by side
  std::array<Side, sides> sides_;
  std::vector<Ball> balls_;  // around the subjects
  bool aimed_ = false;
};

}  // namespace polyhull::processor
