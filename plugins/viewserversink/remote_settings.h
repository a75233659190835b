// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Properties of a capture machine's element that its clients set.
#pragma once

#include <gst/gst.h>

#include <string>

namespace polyhull::element {

/// Sets properties of the element \p name that is in the same pipeline as \p beside, as \p text says:
/// "sigma=1.5 key-color=0x30a050", values as gst-launch has them. Only those that may change while it
/// plays can be set, within their ranges, and no texts but polygons: no files, no names; if one of
/// \p text cannot, none is. Throws Error (bad_input)
/// that says which and why; not_found where there is no such element.
void apply_remote_settings(GstElement* beside, const std::string& name, const std::string& text);

}  // namespace polyhull::element
