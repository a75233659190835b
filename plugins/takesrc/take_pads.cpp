// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/takesrc/take_pads.h"

#include <fmt/format.h>

#include <cstdio>
#include <vector>

#include "plugins/common/object_lock.h"

namespace polyhull::element {

std::string take_pad_name(const std::string& stream, std::size_t index,
                          std::set<std::string>& taken) {
  guint number = 0;
  if (std::sscanf(stream.c_str(), "sink_%u", &number) != 1) number = static_cast<guint>(index);
  for (;; ++number) {
    std::string name = fmt::format("src_{}", number);
    if (taken.insert(name).second) return name;
  }
}

GstPad* take_pad(GstElement* element, const std::string& name, GstPadEventFunction event,
                 GstPadQueryFunction query) {
  if (GstPad* pad = gst_element_get_static_pad(element, name.c_str())) {
    gst_object_unref(pad);
    return pad;
  }
  GstPad* pad = gst_pad_new_from_template(
      gst_element_class_get_pad_template(GST_ELEMENT_GET_CLASS(element), "src_%u"), name.c_str());
  gst_pad_set_event_function(pad, event);
  gst_pad_set_query_function(pad, query);
  gst_pad_use_fixed_caps(pad);
  gst_pad_set_active(pad, TRUE);
  gst_element_add_pad(element, pad);
  return pad;
}

void remove_other_pads(GstElement* element, const std::set<std::string>& names) {
  std::vector<GstPad*> others;
  {
    const ObjectLock lock(element);
    for (GList* item = element->srcpads; item != nullptr; item = item->next)
      if (!names.contains(GST_OBJECT_NAME(item->data)))
        others.push_back(GST_PAD(gst_object_ref(item->data)));
  }
  for (GstPad* pad : others) {
    gst_pad_set_active(pad, FALSE);
    gst_element_remove_pad(element, pad);
    gst_object_unref(pad);
  }
}

}  // namespace polyhull::element
