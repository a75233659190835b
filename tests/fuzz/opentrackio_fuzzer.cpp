// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: any bytes as a sample in either encoding, as one packet, and as packets of 64 bytes
// whose checksums are put right (in one of the forms that are sent), with what they make put together
// and read by one who remembers.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>
#include <vector>

#include "base/error.h"
#include "track/opentrackio_sample.h"

using namespace polyhull;

static void read(OpenTrackIOReader& reader, const OpenTrackIOBytes& sample) {
  try {
    const TrackedPose pose = reader.read(sample, "host").pose;
    if (!std::isfinite(pose.place.x) || !std::isfinite(pose.place.y) ||
        !std::isfinite(pose.place.z))
      std::abort();
    for (const double k : pose.distortion)
      if (!std::isfinite(k)) std::abort();
    camera_of(pose, 640, 480, 40.0);
  } catch (const Error&) {
  }
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<std::uint8_t> all(data, data + size);
  OpenTrackIOReader reader;
  read(reader, {OpenTrackIOEncoding::json, {}, all});
  read(reader, {OpenTrackIOEncoding::cbor, {}, all});
  try {
    read(reader, whole_sample(parse_opentrackio_packet(all)));
  } catch (const Error&) {
  }
  OpenTrackIOSegments segments;
  for (std::size_t begins = 0; begins < size; begins += 64) {
    std::vector<std::uint8_t> packet(data + begins, data + std::min(begins + 64, size));
    for (int fixed = 0; fixed < 2; ++fixed) {
      try {
        if (const auto sample = segments.add(parse_opentrackio_packet(packet)))
          read(reader, *sample);
      } catch (const Error&) {
      }
      if (packet.size() < 16) break;
      std::copy_n("OTrk", 4, packet.begin());
      packet[12] &= 0x80;
      packet[13] = static_cast<std::uint8_t>(packet.size() - 16);
      const std::span<const std::uint8_t> bytes(packet);
      const std::uint16_t sum = fletcher16(bytes.first(14), bytes.subspan(16), 255 + size % 2);
      packet[14] = static_cast<std::uint8_t>(sum >> 8);
      packet[15] = static_cast<std::uint8_t>(sum);
      if (size % 3 == 0) std::swap(packet[14], packet[15]);
    }
  }
  return 0;
}
