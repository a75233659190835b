// SPDX-License-Identifier: LGPL-2.1-or-later
#include "common/enums.h"

namespace polyhull::element {

GType register_enum(const char* type_name, const GEnumValue* values) {
  const GType known = g_type_from_name(type_name);
  if (known != 0) return known;
  const GType type = g_enum_register_static(type_name, values);
  gst_type_mark_as_plugin_api(type, static_cast<GstPluginAPIFlags>(0));
  return type;
}

}  // namespace polyhull::element
