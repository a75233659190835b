// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: any bytes as a datagram of FreeD's packets, by each kind of checksum, and as one
// packet with the checksum put right.
#include <cmath>
#include <cstdlib>
#include <span>
#include <vector>

#include "base/error.h"
#include "track/freed.h"

static void parse(std::span<const std::uint8_t> bytes, polyhull::FreeDChecksum checksum) {
  try {
    const polyhull::TrackedPose pose =
        polyhull::pose_of(polyhull::parse_freed(bytes, checksum), {});
    if (!std::isfinite(pose.place.x + pose.place.y + pose.place.z)) std::abort();
    polyhull::camera_of(pose, 640, 480, 40.0);
  } catch (const polyhull::Error&) {
  }
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::uint8_t> bytes(data, data + size);
  const auto checksum = static_cast<polyhull::FreeDChecksum>(size % 3);
  std::size_t taken = 0;
  for (const auto packet : polyhull::freed_packets(bytes)) {
    taken += packet.size();
    if (!polyhull::is_other_freed(packet)) parse(packet, checksum);
  }
  if (taken > size) std::abort();
  if (size < polyhull::freed_packet_size) return 0;
  bytes.resize(polyhull::freed_packet_size);
  bytes[0] = 0xD1;
  unsigned sum = 0x40;
  for (std::size_t i = 0; i + 1 < bytes.size(); ++i) sum -= bytes[i];
  bytes.back() = static_cast<std::uint8_t>(sum);
  parse(bytes, polyhull::FreeDChecksum::required);
  return 0;
}
