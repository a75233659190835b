// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The matte of a frame, plane by itself, on its way from chromamatte over gaussblur to
/// contourfind.
///
/// The buffer's alpha is what counts: it is all that elements of others see, and all that comes
/// back from a file or a wire. Beside it this meta carries what the alpha was made of: the plane
/// with its block states, so that the next element need not gather it from every fourth byte of the
/// frame, and after the blur the field with 7 more bits than the alpha has, so that the contours
/// lose nothing to rounding, beside the plane that was blurred, which becomes the view's alpha.
/// Elements that make new frames drop the meta (it is tagged as depending on memory, size and
/// colour), and then the alpha is read instead. Those that draw into a frame in place keep it: the
/// frame's memory, which chromamatte takes from an allocator that notes it, shows whether somebody
/// may have written since; where it may be so, the alpha is compared.
#pragma once

#include <gst/video/video.h>

#include "silhouette/pixels/matte_content.h"

namespace polyhull::element {

/// Attaches \p content to \p buffer (writable), instead of any that is there. To be called when the
/// pixels are written, or mapped for the last time.
void set_matte(GstBuffer* buffer, MatteContent content);

/// Whether nobody has mapped the memory of \p buffer for writing since a matte was attached to it;
/// false, too, where that cannot be known.
bool is_unwritten(GstBuffer* buffer);

/// Where the matte lies in a frame: the alpha of RGBA, or GRAY8 as it is.
struct AlphaView {
  std::uint8_t* first;
  std::ptrdiff_t stride;
  int step, width, height;
};
AlphaView alpha_of(const GstVideoFrame& frame);

/// What a frame without a matte attached shows, in a plane of \p pool.
std::shared_ptr<const Matte> read_matte(const AlphaView& alpha, PlanePool<Matte>& pool);

/// What is attached to \p buffer, whose alpha is \p alpha, where that still holds; else null. Valid
/// as long as the buffer is held. \p unwritten: is_unwritten(), asked before the frame was mapped.
const MatteContent* attached_matte(GstBuffer* buffer, const AlphaView& alpha, bool unwritten);

}  // namespace polyhull::element
