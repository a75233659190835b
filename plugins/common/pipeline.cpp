// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/pipeline.h"

#include "base/error.h"

namespace polyhull::element {
namespace {

Ref<GstElement> top_of(GstElement* element) {
  Ref<GstElement> top(GST_ELEMENT(gst_object_ref(element)));
  while (GstObject* parent = gst_object_get_parent(GST_OBJECT(top.get())))
    top.reset(GST_ELEMENT(parent));
  return top;
}

}  // namespace

Ref<GstElement> find_in_pipeline(GstElement* seeker, const std::string& name, const char* property,
                                 const char* what, const std::function<bool(GstElement*)>& suits) {
  Ref<GstElement> found;
  const Ref<GstElement> top = top_of(seeker);
  std::vector<Ref<GstElement>> elements;
  if (GST_IS_BIN(top.get())) elements = elements_in(GST_BIN(top.get()));
  for (Ref<GstElement>& element : elements) {
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
