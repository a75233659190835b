// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/freed.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "base/error.h"
#include "track/packet_error.h"

namespace polyhull {
namespace {

constexpr std::uint8_t position_and_orientation = 0xD1, poll = 0xD0;
constexpr std::size_t poll_size = 4;
constexpr double steps_per_degree = 32768.0;
constexpr double steps_per_metre = 64.0 * 1000.0;

std::uint32_t unsigned_at(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint32_t>(bytes[at]) << 16 | bytes[at + 1] << 8 | bytes[at + 2];
}

double signed_at(std::span<const std::uint8_t> bytes, std::size_t at) {
  const auto value = static_cast<std::int32_t>(unsigned_at(bytes, at));
  return value < 0x800000 ? value : value - 0x1000000;
}

/// With its checksum a message sums up to this.
bool sums_up(std::span<const std::uint8_t> bytes) {
  return std::accumulate(bytes.begin(), bytes.end(), 0u) % 256 == 0x40;
}

bool is_padding(std::uint8_t byte) {
  return byte == 0 || byte == '\n' || byte == '\r' || byte == ' ' || byte == 0xFF;
}

/// How many of \p bytes are one packet; 0: they begin none.
std::size_t size_of_first(std::span<const std::uint8_t> bytes) {
  if (bytes[0] == position_and_orientation) return std::min(bytes.size(), freed_packet_size);
  const bool is_poll =
      bytes[0] == poll && bytes.size() >= poll_size && sums_up(bytes.first(poll_size));
  return is_poll ? poll_size : 0;
}

}  // namespace

std::vector<std::span<const std::uint8_t>> freed_packets(std::span<const std::uint8_t> datagram) {
  std::vector<std::span<const std::uint8_t>> packets;
  auto rest = datagram;
  for (;;) {
    while (!rest.empty() && is_padding(rest[0])) rest = rest.subspan(1);
    const std::size_t size = rest.empty() ? 0 : size_of_first(rest);
    if (size == 0) break;
    packets.push_back(rest.first(size));
    rest = rest.subspan(size);
  }
  if (packets.empty()) packets.push_back(datagram);
  return packets;
}

bool is_freed(std::span<const std::uint8_t> bytes) {
  // D9 is none of its types, and begins a CBOR that says that it is one.
  return !bytes.empty() && bytes[0] >= poll && bytes[0] <= 0xDB && bytes[0] != 0xD9;
}

bool is_other_freed(std::span<const std::uint8_t> bytes) {
  return is_freed(bytes) && bytes[0] != position_and_orientation && bytes.size() >= poll_size &&
         sums_up(bytes);
}

FreeDPacket parse_freed(std::span<const std::uint8_t> bytes, FreeDChecksum checksum) {
  if (bytes.size() < freed_packet_size)
    throw PacketError(PacketError::Fault::truncated,
                      "FreeD: a packet D1 has {} bytes, this one has {}.", freed_packet_size,
                      bytes.size());
  if (bytes.size() > freed_packet_size)
    throw Error(Error::Kind::bad_input, "FreeD: a packet D1 has {} bytes, this one has {}.",
                freed_packet_size, bytes.size());
  if (bytes[0] != position_and_orientation)
    throw Error(Error::Kind::bad_input,
                "FreeD: packet of type 0x{:02X}; only 0xD1 (position and orientation) is read.",
                int{bytes[0]});
  unsigned sum = 0x40;
  for (const std::uint8_t byte : bytes.first(freed_packet_size - 1)) sum -= byte;
  const bool none = checksum == FreeDChecksum::ignored ||
                    (checksum == FreeDChecksum::zero_is_none && bytes.back() == 0);
  if (!none && (sum & 0xFF) != bytes.back())
    throw PacketError(PacketError::Fault::checksum,
                      "FreeD: the checksum is 0x{:02X}, the bytes make 0x{:02X}.{}",
                      int{bytes.back()}, sum & 0xFF,
                      bytes.back() == 0 ? " Where the sender makes none and leaves 0, set "
                                          "checksum=zero-is-none."
                                        : "");
  FreeDPacket packet;
  packet.camera = bytes[1];
  for (std::size_t i = 0; i < 3; ++i) {
    packet.degrees[i] = signed_at(bytes, 2 + 3 * i) / steps_per_degree;
    packet.metres[i] = signed_at(bytes, 11 + 3 * i) / steps_per_metre;
  }
  packet.zoom = unsigned_at(bytes, 20);
  packet.focus = unsigned_at(bytes, 23);
  return packet;
}

std::optional<std::string> doubt_in_focal_length(double focal_length_mm, double sensor_width_mm) {
  constexpr double shortest = 2.0, longest = 150.0, least_degrees = 5.0;
  constexpr double longest_made = 2000.0;  // a box lens of 107 times from 8.4 mm, its extender in
  const double seen = sensor_width_mm > 0.0 ? 360.0 / std::numbers::pi *
                                                  std::atan(0.5 * sensor_width_mm / focal_length_mm)
                                            : 0.0;
  if (focal_length_mm >= shortest && (focal_length_mm <= longest || seen >= least_degrees))
    return {};
  const std::string sees =
      seen > 0.0 ? fmt::format(" ({:.1f} degrees from side to side)", seen) : "";
  return fmt::format("{:g} mm{}, which {}", focal_length_mm, sees,
                     focal_length_mm >= shortest && focal_length_mm <= longest_made
                         ? "only long broadcast lenses reach"
                         : "is no lens's focal length");
}

TrackedPose pose_of(const FreeDPacket& packet, const FreeDSettings& settings) {
  auto order = settings.axis;
  std::sort(order.begin(), order.end());
  if (order != std::array<int, 3>{0, 1, 2})
    throw Error(Error::Kind::bad_input,
                "FreeD: the order of the axes must name each of x, y and height once.");
  TrackedPose pose;
  pose.source = fmt::format("freed {}", packet.camera);
  Vec3 degrees;
  for (int i = 0; i < 3; ++i) {
    const double place = packet.metres[static_cast<std::size_t>(settings.axis[i])];
    pose.place[i] = settings.sign[i] * place + settings.offset[i];
    degrees[i] = settings.turn_sign[i] * packet.degrees[i] + settings.turn_offset[i];
  }
  // FreeD's pan grows to the right, a right-handed turn about z to the left.
  pose.axes = axes_of_angles(-degrees[0], degrees[1], degrees[2]);
  if (settings.zoom_is_focal_length && packet.zoom > 0) pose.focal_length_mm = packet.zoom / 100.0;
  return pose;
}

}  // namespace polyhull
