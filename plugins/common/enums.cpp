// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/enums.h"

#include <string>

namespace polyhull::element {
namespace {

/// What gst-launch and gst_util_set_object_arg() make a value from: a nick, a name or a number.
/// They say no more than that a property could not be set; this says what it takes.
gboolean read_enum(GValue* to, const gchar* text, GParamSpec* spec) {
  auto* known = static_cast<GEnumClass*>(g_type_class_ref(G_VALUE_TYPE(to)));
  const GEnumValue* found = g_enum_get_value_by_nick(known, text);
  if (found == nullptr) found = g_enum_get_value_by_name(known, text);
  if (found == nullptr) {
    gchar* end = nullptr;
    const gint64 number = g_ascii_strtoll(text, &end, 0);
    if (end != text && *end == '\0' && number >= G_MININT && number <= G_MAXINT)
      found = g_enum_get_value(known, static_cast<gint>(number));
  }
  if (found != nullptr) {
    g_value_set_enum(to, found->value);
  } else {
    std::string accepted;
    for (guint i = 0; i < known->n_values; ++i)
      accepted +=
          std::string("\n  ") + known->values[i].value_nick + ": " + known->values[i].value_name;
    g_warning("%s%s does not take \"%s\", but one of these:%s",
              spec != nullptr ? "The property " : "The type ",
              spec != nullptr ? spec->name : G_VALUE_TYPE_NAME(to), text, accepted.c_str());
  }
  g_type_class_unref(known);
  return found != nullptr;
}

gboolean read_enum_without_property(GValue* to, const gchar* text) {
  return read_enum(to, text, nullptr);
}

gchar* write_enum(const GValue* value) {
  auto* known = static_cast<GEnumClass*>(g_type_class_ref(G_VALUE_TYPE(value)));
  const GEnumValue* found = g_enum_get_value(known, g_value_get_enum(value));
  gchar* text = found != nullptr ? g_strdup(found->value_nick)
                                 : g_strdup_printf("%d", g_value_get_enum(value));
  g_type_class_unref(known);
  return text;
}

gint compare_enums(const GValue* a, const GValue* b) {
  const gint left = g_value_get_enum(a), right = g_value_get_enum(b);
  return left < right   ? GST_VALUE_LESS_THAN
         : left > right ? GST_VALUE_GREATER_THAN
                        : GST_VALUE_EQUAL;
}

}  // namespace

GType register_enum_values(const char* type_name, const GEnumValue* values) {
  const GType type = g_enum_register_static(type_name, values);
  gst_type_mark_as_plugin_api(type, static_cast<GstPluginAPIFlags>(0));
  // GStreamer keeps the pointer for as long as the process lives, as it does the type.
  auto* table = g_new0(GstValueTable, 1);
  table->type = type;
  table->compare = compare_enums;
  table->serialize = write_enum;
  table->deserialize = read_enum_without_property;
  table->deserialize_with_pspec = read_enum;
  gst_value_register(table);
  return type;
}

const char* nick_of_value(GType type, int value) {
  auto* known = static_cast<GEnumClass*>(g_type_class_ref(type));
  const GEnumValue* found = g_enum_get_value(known, value);
  const char* nick =
      found != nullptr ? found->value_nick : "unknown";  // static, as register_enum() asks
  g_type_class_unref(known);
  return nick;
}

}  // namespace polyhull::element
