// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Properties whose text the library must understand.
#pragma once

#include <string>

#include "base/error.h"
#include "plugins/common/property_table.h"

namespace polyhull::element {

/// The text at \p Member, which \p Parse must take; \p form says to people what it takes.
template <auto Member, auto Parse>
constexpr auto parsed_property(const char* name, const char* blurb, const char* form) {
  using Settings = typename detail::MemberOf<Member>::Settings;
  Property<Settings> row = property<Member>(name, blurb);
  row.set = [](Settings& settings, const GValue* value) {
    const gchar* text = g_value_get_string(value);
    try {
      Parse(text != nullptr ? text : "");
    } catch (const Error&) {
      return false;
    }
    settings.*Member = text != nullptr ? text : "";
    return true;
  };
  row.form = form;
  return row;
}

}  // namespace polyhull::element
