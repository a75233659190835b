// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A View as application/x-polyhull-view bytes, and back. Layout: payload.h.
#pragma once

#include "mesh/view.h"
#include "wire/payload.h"

namespace polyhull {

/// Everything but the pixels; the payload is these bytes followed by view.pixels. Throws Error for
/// a view that read_view() would refuse.
std::vector<std::uint8_t> write_view_header(const View& view);

/// The whole payload in one run. Throws Error as write_view_header() does.
std::vector<std::uint8_t> write_view(const View& view);

/// Parses bytes from anywhere: sizes, indices, numbers and the region of interest are checked.
/// View::pixels borrows from \p segments. Throws Error, see Payload.
View read_view(std::span<const Bytes> segments);

/// Only trigger number, times and clock; the rest is not looked at. Throws Error for bytes that are
/// no view's, and for times and clocks that read_view() would refuse.
View read_view_times(std::span<const Bytes> segments);

/// The same as read_view() for a payload in one run.
View read_view(Bytes bytes);

/// Bytes of one pixel; 0 for PixelFormat::none.
int bytes_per_pixel(PixelFormat format);

/// The fewest bytes that View::pixels may have for its region of interest and stride.
std::size_t pixels_needed(const View& view);

/// Throws Error if \p view breaks a rule of read_view().
void validate_view(const View& view);

}  // namespace polyhull
