// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// C++ enumerations as GObject enumerations.
#pragma once

#include <gst/gst.h>

namespace polyhull::element {

/// Registers an enumeration once. \p values must be static and end with {0, nullptr, nullptr}; each
/// value's name is a sentence for people, its nick what users type. Marked as part of the plugin's
/// interface, so that the documentation tools list it. A text that is none of the values, as in
/// `chromamatte key=yellow`, makes a warning that lists them.
GType register_enum(const char* type_name, const GEnumValue* values);

/// The GObject type of the C++ enumeration T: specialised where T gets a property.
template <class T>
GType enum_type();

}  // namespace polyhull::element
