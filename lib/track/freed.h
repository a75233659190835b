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
///             28   0x40 minus the sum of all before, modulo 256 (some senders leave it 0)
///
/// All numbers are big-endian. A place is thus within 1/128 mm of the truth, an angle within 1/65536
/// of a degree.
///
/// Packets of other types, such as polls (D0: type, camera, command, checksum), may come between.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "track/tracked_pose.h"

namespace polyhull {

constexpr std::size_t freed_packet_size = 29;

/// What the last byte of a packet is good for.
enum class FreeDChecksum {
  required,      ///< it must be right
  zero_is_none,  ///< it must be right, or 0, as of senders that make none
  ignored,
};

/// What senders do differently. The defaults are the protocol's.
struct FreeDSettings {
  std::array<int, 3> axis{0, 1,
                          2};  ///< which of the packet's x, y, height is x, y, z: a permutation
  Vec3 sign{1.0};              ///< of x, y, z; 1 or -1
  Vec3 turn_sign{1.0};         ///< of pan, tilt, roll; 1 or -1
  Vec3 offset{0.0};            ///< metres, added to x, y, z
  Vec3 turn_offset{0.0};       ///< degrees, added to pan, tilt, roll
  FreeDChecksum checksum = FreeDChecksum::required;
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

/// The packets that \p datagram holds one after the other, with line ends or padding (zeros, 0xFF)
/// around them. What stands behind one and begins none is left out; where there is no packet the whole
/// datagram is one, to be refused.
std::vector<std::span<const std::uint8_t>> freed_packets(std::span<const std::uint8_t> datagram);

/// Whether \p bytes begin as a message of FreeD's, of whatever type, does.
bool is_freed(std::span<const std::uint8_t> bytes);

/// Whether \p bytes are a whole message of FreeD's that tells no pose, such as a poll.
bool is_other_freed(std::span<const std::uint8_t> bytes);

/// The packet that \p bytes hold. Throws PacketError for fewer bytes and for a wrong
/// checksum, Error (bad_input) for more bytes and another type.
FreeDPacket parse_freed(std::span<const std::uint8_t> bytes,
                        FreeDChecksum checksum = FreeDChecksum::required);

/// Why \p focal_length_mm before a sensor of \p sensor_width_mm (0: unknown) may be no focal length but
/// an encoder's value; none where it is plainly one. One above 150 mm, as the longest broadcast lenses
/// have, is doubted unless the sensor is so wide that 5 degrees are seen from side to side; one below
/// 2 mm or above 2 m is none.
std::optional<std::string> doubt_in_focal_length(double focal_length_mm, double sensor_width_mm);

/// \p packet as a pose of the source "freed N". Throws Error (bad_input) for settings whose `axis` is
/// no permutation.
TrackedPose pose_of(const FreeDPacket& packet, const FreeDSettings& settings);

}  // namespace polyhull
