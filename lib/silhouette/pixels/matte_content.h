// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Mattes that are handed on from stage to stage: what is shared, compared and used again.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "silhouette/pixels/matte.h"

namespace polyhull {

/// A frame's matte in either form. Exactly one of the first two planes is set.
struct MatteContent {
  std::shared_ptr<const Matte> matte;  ///< not blurred, or blurred and thresholded
  std::shared_ptr<const Field> field;  ///< blurred
  double sigma = 0.0;                  ///< px; what it was blurred with
  std::shared_ptr<const Matte> keyed;  ///< with field: what was blurred
};

/// Whether the alpha in every \p step-th byte from \p first on, rows \p stride bytes apart, still
/// is what \p content was attached for. Looks at every value.
bool is_alpha_of(const MatteContent& content, const std::uint8_t* first, std::ptrdiff_t stride,
                 int step);

/// Whether two contents have the same values; compares only where the blocks are mixed.
bool same_content(const MatteContent& a, const MatteContent& b);

/// Planes that are used again when the last buffer that carried them is gone.
template <class Plane>
class PlanePool {
 public:
  std::shared_ptr<Plane> take() {
    for (const auto& plane : planes_) {
      // Only the pool holds it, so nobody else can take a share meanwhile.
      if (plane.use_count() == 1) {
        std::atomic_thread_fence(std::memory_order_acquire);
        return plane;
      }
    }
    auto plane = std::make_shared<Plane>();
    if (planes_.size() < 8) planes_.push_back(plane);
    return plane;
  }
  void clear() { planes_.clear(); }

 private:
  std::vector<std::shared_ptr<Plane>> planes_;
};

}  // namespace polyhull
