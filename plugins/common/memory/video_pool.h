// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The pool that an element takes its output pictures from.
#pragma once

#include <gst/gl/gl.h>

namespace polyhull::element {

/// Puts a pool for output pictures into an answered allocation query: textures of \p context, or
/// system memory where it is null. The pool that the query offers is taken where it is of that kind
/// and accepts the size; else a new one. False where the query's caps are no video or no pool
/// can be configured for them.
bool decide_video_pool(GstQuery* query, GstGLContext* context);

}  // namespace polyhull::element
