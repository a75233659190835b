// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// FreeD's packet D1, "camera position and orientation", as trackers send it over UDP.
///
///      byte   0   0xD1
///             1   camera
///          2 –  4  pan, to the right as seen from above     signed, 1/32768 degree
///          5 –  7  tilt, upwards                            likewise
///          8 – 10  roll, clockwise as the operator sees it  likewise
///         11 – 19  x, y, height                             signed, 1/64 mm, 3 bytes each
///         20 – 25  zoom, focus                              unsigned, 3 bytes each
///         26 – 27  spare
///             28   0x40 minus the sum of all before, modulo 256
///
/// All numbers are big-endian. A place is thus within 1/128 mm of the truth, an angle within 1/65536
/// of a degree.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "track/tracked_pose.h"

namespace polyhull {

constexpr std::size_t freed_packet_size = 29;

/// What senders do differently. The defaults are the protocol's.
struct FreeDSettings {
  std::array<int, 3> axis{0, 1,
                          2};  ///< which of the packet's x, y, height is x, y, z: a permutation
  Vec3 sign{1.0};              ///< of x, y, z; 1 or -1
  Vec3 turn_sign{1.0};         ///< of pan, tilt, roll; 1 or -1
  Vec3 offset{0.0};            ///< metres, added to x, y, z
  Vec3 turn_offset{0.0};       ///< degrees, added to pan, tilt, roll
  bool zoom_is_focal_length = false;  ///< zoom holds the focal length in 1/100 mm, not an encoder's
                                      ///< value, and a zoom of 0 tells nothing
};

struct FreeDPacket {
  std::uint8_t camera = 0;
  std::array<double, 3> degrees{};  ///< pan, tilt, roll as sent
  std::array<double, 3> metres{};   ///< x, y, height as sent
  std::uint32_t zoom = 0;
  std::uint32_t focus = 0;
};

/// The packet that \p bytes hold. Throws PacketError for fewer bytes and for a wrong
/// checksum, Error (bad_input) for more bytes and another type.
FreeDPacket parse_freed(std::span<const std::uint8_t> bytes);

/// \p packet as a pose of the source "freed N". Throws Error (bad_input) for settings whose `axis` is
/// no permutation.
TrackedPose pose_of(const FreeDPacket& packet, const FreeDSettings& settings);

}  // namespace polyhull
