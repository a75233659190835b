// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/pipeline.h"

#include <vector>

#include "base/error.h"

namespace polyhull::element {
namespace {

ElementReference top_of(GstElement* element) {
  ElementReference top(GST_ELEMENT(gst_object_ref(element)));
  while (GstObject* parent = gst_object_get_parent(GST_OBJECT(top.get())))
    top.reset(GST_ELEMENT(parent));
  return top;
}

std::vector<ElementReference> elements_in(GstElement* top) {
  std::vector<ElementReference> found;
  if (!GST_IS_BIN(top)) return found;
  GstIterator* iterator = gst_bin_iterate_recurse(GST_BIN(top));
  GValue item = G_VALUE_INIT;
  for (GstIteratorResult result;
       (result = gst_iterator_next(iterator, &item)) != GST_ITERATOR_DONE;) {
    if (result == GST_ITERATOR_ERROR) break;
    if (result == GST_ITERATOR_RESYNC) {
      found.clear();
      gst_iterator_resync(iterator);
      continue;
    }
    found.emplace_back(GST_ELEMENT(g_value_dup_object(&item)));
    g_value_reset(&item);
  }
  g_value_unset(&item);
  gst_iterator_free(iterator);
  return found;
}

}  // namespace

ElementReference find_in_pipeline(GstElement* seeker, const std::string& name, const char* property,
                                  const char* what, const std::function<bool(GstElement*)>& suits) {
  ElementReference found;
  for (ElementReference& element : elements_in(top_of(seeker).get())) {
    if (!name.empty() && name != GST_OBJECT_NAME(element.get())) continue;
    if (!suits(element.get())) continue;
    if (found != nullptr)
      throw Error(Error::Kind::bad_input,
                  "There is more than one {} in the pipeline; name the one with the property {}.",
                  what, property);
    found = std::move(element);
  }
  if (found != nullptr) return found;
  if (name.empty())
    throw Error(Error::Kind::not_found, "There is no {} in the pipeline; put one into it.", what);
  throw Error(Error::Kind::not_found,
              "There is no {} of the name '{}' in the pipeline; look at the property {}.", what,
              name, property);
}

}  // namespace polyhull::element
