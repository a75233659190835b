// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Mouse and keys that a video sink sends back, for a viewport.
#pragma once

#include <gst/gst.h>

#include "scene/viewport_control.h"

namespace polyhull::element {

/// Takes a navigation event; true: the view changes. \p height: of the picture that the mouse is
/// on, pixels. The caller holds the lock that protects \p control.
bool navigate(GstEvent* event, ViewportControl& control, int height);

}  // namespace polyhull::element
