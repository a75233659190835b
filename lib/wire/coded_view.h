// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A View whose pixels are packed (pixel_coding.h) as application/x-polyhull-view bytes, and back.
#pragma once

#include "wire/pixel_coding.h"
#include "wire/view_payload.h"

namespace polyhull {

/// A view that came with its pixels packed, or as they are.
struct CodedView {
  View view;  ///< without pixels; its stride is that of rows without gaps, where they are packed
  PixelCoding coding = PixelCoding::raw;
  Bytes block;  ///< borrowed
  PixelShape shape() const {
    return {view.roi.width, view.roi.height, bytes_per_pixel(view.format)};
  }
};

/// Everything but the block, which follows these bytes: \p view with its pixels packed by \p coding
/// into \p block_size bytes. Throws Error for a view that read_view() would refuse.
std::vector<std::uint8_t> write_coded_view_header(const View& view, PixelCoding coding,
                                                  std::size_t block_size);

/// Parses bytes from anywhere as read_view() does; the block is borrowed and not unpacked. Throws
/// Error.
CodedView read_coded_view(std::span<const Bytes> segments);

}  // namespace polyhull
