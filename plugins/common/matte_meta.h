// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The matte of a frame, plane by itself, on its way from chromamatte over gaussblur to
/// contourfind.
///
/// The buffer's alpha is what counts: it is all that elements of others see, and all that comes
/// back from a file or a wire. Beside it this meta carries what the alpha was made of: the plane
/// with its block states, so that the next element need not gather it from every fourth byte of the
/// frame, and after the blur the field with 7 more bits than the alpha has, so that the contours
/// lose nothing to rounding. Elements that change pixels drop the meta (it is tagged as depending
/// on memory, size and colour); then the alpha is read instead.
#pragma once

#include <gst/gst.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "silhouette/matte.h"

namespace polyhull::element {

/// Exactly one of the two planes is set.
struct MatteContent {
  std::shared_ptr<const Matte> matte;  ///< not blurred, or blurred and thresholded
  std::shared_ptr<const Field> field;  ///< blurred
  double sigma = 0.0;                  ///< px; what it was blurred with
};

/// Attaches \p content to \p buffer (writable), instead of any that is there.
void set_matte(GstBuffer* buffer, MatteContent content);

/// The content attached to \p buffer if its planes have the size given, else null. Valid as long as
/// the buffer is held.
const MatteContent* get_matte(GstBuffer* buffer, int width, int height);

/// Whether the alpha in every \p step-th byte from \p first on, rows \p stride bytes apart, still
/// is what \p content was attached for: an element that draws into a frame in place keeps the
/// metas. Looks at every value of mixed blocks, and in every eighth row at one value of each
/// uniform block.
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

}  // namespace polyhull::element
