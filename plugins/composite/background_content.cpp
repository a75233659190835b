// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/composite/background_content.h"

#include <gst/video/video.h>

#include <algorithm>

namespace polyhull::element {

bool same_memory(GstBuffer* a, GstBuffer* b) {
  const guint count = gst_buffer_n_memory(a);
  if (count != gst_buffer_n_memory(b)) return false;
  for (guint i = 0; i < count; ++i)
    if (gst_buffer_peek_memory(a, i) != gst_buffer_peek_memory(b, i)) return false;
  const GstVideoMeta* x = gst_buffer_get_video_meta(a);
  const GstVideoMeta* y = gst_buffer_get_video_meta(b);
  if (x == nullptr || y == nullptr) return x == y;
  const guint planes = x->n_planes;
  return x->format == y->format && planes == y->n_planes &&
         std::equal(x->offset, x->offset + planes, y->offset) &&
         std::equal(x->stride, x->stride + planes, y->stride);
}

bool is_sole_owner(GstBuffer* frame) {
  return gst_buffer_is_writable(frame) && gst_buffer_is_all_memory_writable(frame);
}

std::uint64_t BackgroundContent::number_of(GstBuffer* frame) {
  if (is_sole_owner(frame)) {
    reset();
    return 0;
  }
  if (held_ == nullptr || !same_memory(held_, frame)) ++number_;
  gst_buffer_replace(&held_, frame);
  return number_;
}

}  // namespace polyhull::element
