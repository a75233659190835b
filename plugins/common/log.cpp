// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/log.h"

namespace polyhull::element {

GstDebugCategory* category_of(gpointer object) {
  g_autoptr(GstObject) element = GST_IS_ELEMENT(object) ? GST_OBJECT(gst_object_ref(object))
                                                        : gst_object_get_parent(GST_OBJECT(object));
  GstElementFactory* factory =
      GST_IS_ELEMENT(element) ? gst_element_get_factory(GST_ELEMENT(element)) : nullptr;
  GstDebugCategory* category = nullptr;
  if (factory != nullptr) GST_DEBUG_CATEGORY_GET(category, GST_OBJECT_NAME(factory));
  return category != nullptr ? category : GST_CAT_DEFAULT;
}

std::string time_text(std::int64_t time) {
  g_autofree gchar* text = g_strdup_printf("%" GST_TIME_FORMAT, GST_TIME_ARGS(clock_time(time)));
  return text;
}

void log_property(GObject* object, const GValue* value, const GParamSpec* spec) {
  GstDebugCategory* category = category_of(object);
  if (gst_debug_category_get_threshold(category) < GST_LEVEL_DEBUG) return;
  g_autofree gchar* text = gst_value_serialize(value);
  if (text == nullptr) text = g_strdup_value_contents(value);
  GST_CAT_DEBUG_OBJECT(category, object, "%s is set to %s", spec->name, text);
}

}  // namespace polyhull::element
