// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Memory for payloads whose size changes from frame to frame, and for frames of which it must be
/// known whether somebody wrote to them. A GstBufferPool serves one size; fresh memory of some
/// megabytes per frame costs more in page faults than it takes to fill it.
#pragma once

#include <gst/gst.h>

#include <cstdint>

namespace polyhull::element {

/// A new allocator of system memory that keeps freed blocks and hands them out again where they
/// fit. In steady state nothing is allocated. Blocks are aligned to 64 bytes. Memories keep the
/// allocator alive, so they may outlive the element that made it. The caller owns the reference.
GstAllocator* make_recycling_allocator();

/// A number that changes whenever somebody maps the memory of \p buffer for writing, and that no
/// other memory ever has. 0 where the buffer is not one memory of such an allocator.
std::uint64_t write_stamp(GstBuffer* buffer);

}  // namespace polyhull::element
