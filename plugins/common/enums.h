// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// C++ enumerations as GObject enumerations.
#pragma once

#include <gst/gst.h>

#include <initializer_list>
#include <vector>

namespace polyhull::element {

/// Registers the enumeration \p type_name. \p values must be static and end with {0, nullptr,
/// nullptr}.
GType register_enum_values(const char* type_name, const GEnumValue* values);

/// One value of an enumeration.
template <class T>
struct EnumValue {
  T value;
  const char* name;  ///< a sentence for people
  const char* nick;  ///< what users type
};

/// Registers an enumeration once. Marked as part of the plugin's interface, so that the
/// documentation tools list it. A text that is none of the values, as in `chromamatte key=yellow`,
/// makes a warning that lists them.
template <class T>
GType register_enum(const char* type_name, std::initializer_list<EnumValue<T>> values) {
  static const GType type = [&] {
    static std::vector<GEnumValue> table;
    for (const EnumValue<T>& v : values)
      table.push_back({static_cast<gint>(v.value), v.name, v.nick});
    table.push_back({0, nullptr, nullptr});
    return register_enum_values(type_name, table.data());
  }();
  return type;
}

/// The GObject type of the C++ enumeration T: specialised where T gets a property.
template <class T>
GType enum_type();

/// What users type for \p value, of the registered enumeration \p type.
const char* nick_of_value(GType type, int value);

/// What users type for \p value.
template <class T>
const char* nick_of(T value) {
  return nick_of_value(enum_type<T>(), static_cast<int>(value));
}

}  // namespace polyhull::element
