// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The subjects' surfaces ready for rays, each in a tree of its own, so that what a body hides of its own
/// light can be told from what others hide. Trees are kept from frame to frame as long as their bodies are
/// the same and asked for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>

#include "base/vector.h"
#include "raytrace/ray_caster.h"

namespace polyhull {

/// A closed surface in scene coordinates.
struct Body {
  std::span<const Vec3f> points;
  std::span<const std::uint32_t> triangles;  ///< three indices of points each
  std::uint64_t content = 0;                 ///< the same number: the same mesh; 0: not known
  Mat4 placement{1.0};                       ///< of that mesh in the scene
};

/// False where no way from \p from to \p to leads through \p box: of the pyramid that they span, no
/// cross-section's box meets it.
bool stands_between(const Bounds& box, const Bounds& from, const Bounds& to);

class BodyTrees {
 public:
  /// Makes body \p number's tree, unless it is that of the last call for the number. Throws Error as
  /// RayCaster.
  void make(std::size_t number, const Body& body);

  /// Sets \p hidden of each of \p rays that body \p number, which make() was called for, meets to 1; the
  /// others stay as they are.
  void hide(std::size_t number, std::span<const Ray> rays, std::span<std::uint8_t> hidden) const;

  /// Gives up those that make() was not called for since the last call.
  void drop_unused();
  std::size_t size() const { return trees_.size(); }

 private:
  struct Tree {
    RayCaster caster{RayCaster::For::one_frame};
    std::optional<std::uint32_t> mesh;
    std::uint64_t content = 0;
    Mat4 placement{1.0};
    bool used = false;
  };
  std::map<std::size_t, Tree> trees_;  // by number
};

}  // namespace polyhull
