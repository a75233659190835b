// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Memory for payloads whose size changes from frame to frame. A GstBufferPool serves one size;
/// fresh memory of some megabytes per frame costs more in page faults than it takes to fill it.
#pragma once

#include <gst/gst.h>

namespace polyhull::element {

/// A new allocator of system memory that keeps freed blocks and hands them out again where they
/// fit. In steady state nothing is allocated. Blocks are aligned to 64 bytes. Memories keep the
/// allocator alive, so they may outlive the element that made it. The caller owns the reference.
GstAllocator* make_recycling_allocator();

}  // namespace polyhull::element
