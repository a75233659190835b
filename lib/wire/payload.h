// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What both application formats have in common: prefix, header, pixel blocks.
///
/// A payload is one run of bytes, little-endian:
///
///     0   4  magic: "PHVW" (view) or "PHMS" (mesh)
///     4   4  version: 1
///     8   4  header size H: offset of the first pixel block, a multiple of 32
///     12  4  FlatBuffer size F, F <= H - 32
///     16  8  pixels size: bytes of all pixel blocks together
///     24  8  zero
///     32  F  FlatBuffer (view.fbs, mesh.fbs), then zeros up to H
///     H   …  pixel blocks, one after the other without gaps
///
/// In one process the blocks can lie in memories of their own: a payload is then a list of segments
/// whose concatenation is that run, header first, and no block is cut by a segment's end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace polyhull {

using Bytes = std::span<const std::uint8_t>;

inline constexpr std::size_t payload_prefix_size = 32;
inline constexpr std::uint32_t payload_version = 1;

/// application/x-polyhull-view or application/x-polyhull-mesh.
enum class PayloadKind { view, mesh };

/// The size H of the header around a FlatBuffer of \p flatbuffer_size bytes.
std::size_t payload_header_size(std::size_t flatbuffer_size);

/// The header of a payload around a finished FlatBuffer, in front of \p pixels_size bytes. Throws
/// Error (unsupported) for a header of 4 GiB or more.
std::vector<std::uint8_t> write_payload_header(PayloadKind kind, Bytes flatbuffer,
                                               std::uint64_t pixels_size);

/// A payload whose prefix has been checked.
class Payload {
 public:
  /// Throws Error (bad_input) where the bytes are too few or not a payload of \p kind and version
  /// 1; Error (unsupported) where the header is cut by a segment's end: join the segments and
  /// retry.
  Payload(PayloadKind kind, std::span<const Bytes> segments);

  /// The FlatBuffer, at an address that is a multiple of 8.
  Bytes flatbuffer() const { return flatbuffer_; }

  /// Takes the next pixel block. Throws Error (bad_input) where the payload ends before the block's
  /// end; Error (unsupported) where a segment's end cuts it.
  Bytes take_block(std::uint64_t size);

  /// Throws Error if pixels are left over.
  void finish() const;

 private:
  const char* what_;
  std::span<const Bytes> segments_;
  Bytes flatbuffer_;
  std::vector<std::uint64_t> aligned_;  // a copy of the FlatBuffer, where its address is not that
  std::uint64_t left_ = 0;              // pixel bytes not yet taken
  std::size_t segment_ = 0;             // the next block starts here,
  std::size_t offset_ = 0;              // this far in
};

/// Whether \p text is well-formed UTF-8 without zero bytes.
bool is_utf8(const std::string& text);

}  // namespace polyhull
