// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Packets of a take made smaller by what their stream carried before.
///
/// Any packet: zstd, told the packet before. A view's or mesh's pictures: what their neighbours and
/// the picture before do not tell (picture_filter.h), its lists of numbers: what the item before does
/// not tell (number_filter.h). So far nothing is lost. With loss a mesh's vertices go to a grid, the
/// pictures' colours become VP8 (picture_video.h), and mattes have 33 levels, while contours and all
/// else stay.
///
/// A packet that stands alone comes at least every so many, or every 8 MiB: a seek unpacks no more
/// than those. What is damaged takes with it what follows up to the next of these. Layout:
/// packed_layout.h.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace polyhull {

enum class Packing {
  none,
  exact,  ///< unpacked it is what it was, byte by byte
  lossy,
};

/// More packets are never unpacked for one.
inline constexpr unsigned longest_key_interval = 250;

/// From one that stands alone to the next, unpacked: so many take up to 20 ms, 30 with loss.
inline constexpr std::uint64_t most_key_bytes = 8u << 20;

struct PackingSettings {
  Packing packing = Packing::none;
  /// Packets from one that stands alone to the next, at most 250; fewer where most_key_bytes says so.
  unsigned key_interval = 8;
  double precision = 0.1;  ///< lossy: how far a vertex may move, mm; 0: not at all
  int quantizer = 16;      ///< lossy: VP8's, of the pictures, 0 (best) to 63
  bool operator==(const PackingSettings&) const = default;
};

/// A packet as it is stored.
struct PackedPacket {
  std::span<const std::uint8_t>
      data;                   ///< lasts until the next; empty: it is better stored as it is
  bool alone = true;          ///< unpacked without any other
  double vertex_error = 0;    ///< mm, of the vertex that moved the furthest
  double colour_error = 0;    ///< sum of the colours' squared errors, 8-bit levels
  std::uint64_t colours = 0;  ///< how many of them there are
};

/// Packs one stream. For one thread at a time.
class PacketPacker {
 public:
  PacketPacker();
  ~PacketPacker();
  PacketPacker(PacketPacker&&) noexcept;
  PacketPacker& operator=(PacketPacker&&) noexcept;

  /// Packs \p packet, which \p caps say what it is. \p before: the take's id of the packet that was
  /// packed before this one; 0: there is none, or it was not written.
  PackedPacket pack(const PackingSettings& settings, std::string_view caps,
                    std::span<const std::uint8_t> packet, std::int64_t before);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Unpacks one stream, from bytes from anywhere. For one thread at a time.
class PacketUnpacker {
 public:
  PacketUnpacker();
  ~PacketUnpacker();
  PacketUnpacker(PacketUnpacker&&) noexcept;
  PacketUnpacker& operator=(PacketUnpacker&&) noexcept;

  /// The id of the packet that \p packed needs; 0: none. Throws Error for what is no packed packet.
  static std::int64_t before(std::span<const std::uint8_t> packed);

  /// The id of the packet that unpack() gave last; 0: none.
  std::int64_t last() const;

  /// What was packed as packet \p id; last() has to be before(packed), or that 0. Throws Error
  /// (bad_input, unsupported); last() is 0 then.
  std::vector<std::uint8_t> unpack(std::int64_t id, std::span<const std::uint8_t> packed);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace polyhull
