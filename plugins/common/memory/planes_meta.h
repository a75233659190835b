// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The planes of a scene's triangles beside the frame that was drawn with them, from scenesrc to
/// composite in one process.
///
/// They say of what view they are, and who takes them compares that with the view it needs, so they
/// may stay with a frame through any element that copies metas, also one that changes the picture.
#pragma once

#include <gst/gst.h>

#include <memory>

#include "view/scene_planes.h"

namespace polyhull::element {

/// Attaches \p planes to \p buffer, which is writable, instead of any that are there; null: none.
void set_planes(GstBuffer* buffer, std::shared_ptr<const ScenePlanes> planes);

/// Those that are attached to \p buffer; null: none.
std::shared_ptr<const ScenePlanes> attached_planes(GstBuffer* buffer);

}  // namespace polyhull::element
