// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The depth of what a frame shows beside it, from trackstamp to composite in one process.
#pragma once

#include <gst/gst.h>

#include <memory>

#include "render/depth_picture.h"

namespace polyhull::element {

/// Attaches \p depth to \p buffer instead of any that is there; null: none. A buffer that is not
/// writable stays as it is.
void set_depth(GstBuffer* buffer, std::shared_ptr<const DepthPicture> depth);

/// What is attached to \p buffer; null: nothing.
std::shared_ptr<const DepthPicture> attached_depth(GstBuffer* buffer);

}  // namespace polyhull::element
