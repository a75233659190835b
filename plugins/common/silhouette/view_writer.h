// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Views of an element that makes one per frame: buffers of application/x-polyhull-view whose
/// memory is used again.
#pragma once

#include <gst/gst.h>

#include "mesh/view.h"
#include "plugins/common/memory/mapped_memory.h"
#include "plugins/common/memory/recycling_allocator.h"

namespace polyhull::element {

class ViewWriter {
 public:
  /// Memory for \p size bytes of pixels (at least 1).
  GstMemory* allocate(std::size_t size) const;

  /// A new buffer: the header of \p view in a memory of its own, then \p pixels (a reference is
  /// added; null where the view has none), whose bytes View::pixels shows. Times, flags and
  /// duration are those of \p source. Throws Error for a view that breaks a rule of
  /// validate_view().
  GstBuffer* write(const View& view, GstMemory* pixels, GstBuffer* source) const;

 private:
  std::unique_ptr<GstAllocator, Unref> allocator_{make_recycling_allocator()};
};

/// The caps of the views made from video of \p video: they keep its frame rate, if it has one.
GstCaps* view_caps_of(const GstCaps* video);

}  // namespace polyhull::element
