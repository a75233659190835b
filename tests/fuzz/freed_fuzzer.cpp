// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: parse_freed() on any bytes, and again with the checksum put right.
#include <cmath>
#include <cstdlib>
#include <vector>

#include "base/error.h"
#include "track/freed.h"

static void parse(const std::vector<std::uint8_t>& bytes) {
  try {
    const polyhull::TrackedPose pose = polyhull::pose_of(polyhull::parse_freed(bytes), {});
    if (!std::isfinite(pose.place.x + pose.place.y + pose.place.z)) std::abort();
    polyhull::camera_of(pose, 640, 480, 40.0);
  } catch (const polyhull::Error&) {
  }
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::uint8_t> bytes(data, data + size);
  parse(bytes);
  if (size < polyhull::freed_packet_size) return 0;
  bytes.resize(polyhull::freed_packet_size);
  bytes[0] = 0xD1;
  unsigned sum = 0x40;
  for (std::size_t i = 0; i + 1 < bytes.size(); ++i) sum -= bytes[i];
  bytes.back() = static_cast<std::uint8_t>(sum);
  parse(bytes);
  return 0;
}
