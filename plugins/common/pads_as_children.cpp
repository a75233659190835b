// SPDX-License-Identifier: LGPL-2.1-or-later
#include "common/pads_as_children.h"

#include <gst/gst.h>

namespace polyhull::element {
namespace {

GObject* child_by_index(GstChildProxy* proxy, guint index) {
  GST_OBJECT_LOCK(proxy);
  gpointer pad = g_list_nth_data(GST_ELEMENT_CAST(proxy)->sinkpads, index);
  if (pad != nullptr) gst_object_ref(pad);
  GST_OBJECT_UNLOCK(proxy);
  return static_cast<GObject*>(pad);
}

guint children_count(GstChildProxy* proxy) {
  GST_OBJECT_LOCK(proxy);
  const guint count = GST_ELEMENT_CAST(proxy)->numsinkpads;
  GST_OBJECT_UNLOCK(proxy);
  return count;
}

}  // namespace

void pads_as_children(void* interface, void*) {
  auto* proxy = static_cast<GstChildProxyInterface*>(interface);
  proxy->get_child_by_index = child_by_index;
  proxy->get_children_count = children_count;
}

}  // namespace polyhull::element
