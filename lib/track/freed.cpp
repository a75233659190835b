// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/freed.h"

#include <algorithm>

#include "base/error.h"
#include "track/packet_error.h"

namespace polyhull {
namespace {

constexpr std::uint8_t position_and_orientation = 0xD1;
constexpr double steps_per_degree = 32768.0;
constexpr double steps_per_metre = 64.0 * 1000.0;

std::uint32_t unsigned_at(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint32_t>(bytes[at]) << 16 | bytes[at + 1] << 8 | bytes[at + 2];
}

double signed_at(std::span<const std::uint8_t> bytes, std::size_t at) {
  const auto value = static_cast<std::int32_t>(unsigned_at(bytes, at));
  return value < 0x800000 ? value : value - 0x1000000;
}

}  // namespace

FreeDPacket parse_freed(std::span<const std::uint8_t> bytes) {
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
  if ((sum & 0xFF) != bytes.back())
    throw PacketError(PacketError::Fault::checksum,
                      "FreeD: the checksum is 0x{:02X}, the bytes make 0x{:02X}.",
                      int{bytes.back()}, sum & 0xFF);
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
