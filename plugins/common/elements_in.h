// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The elements of a bin. Without anything to link, so that programs use it, too.
#pragma once

#include <gst/gst.h>

#include <vector>

#include "plugins/common/references.h"

namespace polyhull::element {

/// All elements in \p bin, those of bins in it included, the latest added first.
inline std::vector<Ref<GstElement>> elements_in(GstBin* bin) {
  std::vector<Ref<GstElement>> found;
  g_autoptr(GstIterator) iterator = gst_bin_iterate_recurse(bin);
  g_auto(GValue) item = G_VALUE_INIT;
  for (;;) {
    const GstIteratorResult result = gst_iterator_next(iterator, &item);
    if (result == GST_ITERATOR_RESYNC) {
      found.clear();
      gst_iterator_resync(iterator);
    } else if (result != GST_ITERATOR_OK) {
      return found;
    } else {
      found.emplace_back(GST_ELEMENT(g_value_dup_object(&item)));
      g_value_reset(&item);
    }
  }
}

}  // namespace polyhull::element
