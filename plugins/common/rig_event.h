// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The event by which a stream of recorded views brings the rig that they were taken with
/// (docs/formats.md, "Rigs beside views").
#pragma once

#include <gst/gst.h>

#include <optional>
#include <string>

namespace polyhull::element {

inline constexpr char rig_event_name[] = "polyhull-rig";

/// \p json: the text of a rig file, valid UTF-8; empty: nobody kept one, which pads need not remember:
/// behind gdpdepay, where caps come after it, a sticky event would be out of order.
inline GstEvent* make_rig_event(const std::string& json) {
  return gst_event_new_custom(
      json.empty() ? GST_EVENT_CUSTOM_DOWNSTREAM : GST_EVENT_CUSTOM_DOWNSTREAM_STICKY,
      gst_structure_new(rig_event_name, "json", G_TYPE_STRING, json.c_str(), nullptr));
}

/// As make_rig_event() took it; nothing for other events.
inline std::optional<std::string> rig_of_event(GstEvent* event) {
  if (!gst_event_has_name(event, rig_event_name)) return {};
  const char* json = gst_structure_get_string(gst_event_get_structure(event), "json");
  return json ? json : "";
}

}  // namespace polyhull::element
