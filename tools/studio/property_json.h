// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Properties of GObjects as JSON, and back.
#pragma once

#include <gst/gst.h>

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace polyhull {

/// Whether a property is a setting that a file may hold: it can be read and set at any time, is no
/// object, and is not the name.
bool is_setting(const GParamSpec* spec);

/// The property's value: true or false, a number, an enumeration's nick, a text (null where it is not
/// set), else GStreamer's text of it ("30000/1001"). Nothing for what JSON has no words for: texts
/// that are not UTF-8, numbers that are not finite, values of which GStreamer makes no text.
std::optional<nlohmann::ordered_json> property_json(GObject* object, const GParamSpec* spec);

/// Sets the property to \p value. Returns what is wrong where it cannot be: of another type, out of
/// range, no nick of the enumeration ("is \"x\"; expected one of a, b"); then nothing is set.
std::optional<std::string> set_property_json(GObject* object, const GParamSpec* spec,
                                             const nlohmann::ordered_json& value);

}  // namespace polyhull
