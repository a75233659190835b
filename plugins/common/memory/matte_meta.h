// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The matte of a frame, plane by itself, on its way from chromamatte over gaussblur to
/// contourfind.
///
/// The buffer's alpha is what counts: it is all that elements of others see, and all that comes
/// back from a file or a wire. Beside it this meta carries what the alpha was made of: the plane
/// with its block states, so that the next element need not gather it from every fourth byte of the
/// frame, and after the blur the field with 7 more bits than the alpha has, so that the contours
/// lose nothing to rounding. Elements that make new frames drop the meta (it is tagged as depending
/// on memory, size and colour), and then the alpha is read instead. Those that draw into a frame in
/// place keep it: whether somebody may have written since shows the frame's memory, which
/// chromamatte takes from an allocator that notes it; where it may be so, the alpha is compared.
#pragma once

#include <gst/gst.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "silhouette/pixels/matte.h"

namespace polyhull::element {

/// Exactly one of the two planes is set.
struct MatteContent {
  std::shared_ptr<const Matte> matte;  ///< not blurred, or blurred and thresholded
  std::shared_ptr<const Field> field;  ///< blurred
  double sigma = 0.0;                  ///< px; what it was blurred with
  std::uint64_t stamp = 0;             ///< set_matte()'s: write_stamp() of the buffer then
};

/// Attaches \p content to \p buffer (writable), instead of any that is there. To be called when the
/// pixels are written, or mapped for the last time.
void set_matte(GstBuffer* buffer, MatteContent content);

/// The content attached to \p buffer if its planes have the size given, else null. Valid as long as
/// the buffer is held.
const MatteContent* get_matte(GstBuffer* buffer, int width, int height);

/// Whether nobody has mapped the memory of \p buffer for writing since a matte was attached to it;
/// false, too, where that cannot be known.
bool is_unwritten(GstBuffer* buffer);

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

}  // namespace polyhull::element
