// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: any bytes as a packed packet of a take, alone and behind a good one, and the same
// bytes packed and unpacked. The first byte tells how: 1 behind a good one (2: an exact one), 4 with what
// zstd gives in the place of what it is given.
#include <cstdlib>
#include <cstring>
#include <vector>

#include "../lib/wire_examples.h"
#include "base/error.h"
#include "open_packet.h"
#include "take/packing.h"
#include "wire/view_payload.h"

using namespace polyhull;

static const std::vector<std::uint8_t>& good_view() {
  static const std::vector<std::uint8_t> bytes =
      write_view(examples::view("cam0", examples::pixels(840, 1)));
  return bytes;
}

static const std::vector<std::uint8_t>& packed_view(Packing packing) {
  static const auto pack = [](Packing way) {
    PacketPacker packer;
    const PackedPacket packed = packer.pack({way}, "application/x-polyhull-view", good_view(), 0);
    return std::vector<std::uint8_t>(packed.data.begin(), packed.data.end());
  };
  static const std::vector<std::uint8_t> exact = pack(Packing::exact), lossy = pack(Packing::lossy);
  return packing == Packing::exact ? exact : lossy;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const int how = data[0];
  std::vector<std::uint8_t> bytes(data + 1, data + size);
  if (how & 4) bytes = test::close_packet(bytes);
  PacketUnpacker unpacker;
  try {
    if (how & 1) {
      unpacker.unpack(1, packed_view(how & 2 ? Packing::exact : Packing::lossy));
      // Told by the good one, whatever it says.
      if (bytes.size() >= 8) std::memcpy(bytes.data(), "\1\0\0\0\0\0\0\0", 8);
    }
    if (PacketUnpacker::before(bytes) == unpacker.last() || PacketUnpacker::before(bytes) == 0)
      unpacker.unpack(2, bytes);
  } catch (const Error&) {
  }
  // What is there, altered here and there, goes through packing unchanged.
  std::vector<std::uint8_t> packet = good_view();
  for (std::size_t i = 0; i + 2 < bytes.size() && i < 30; i += 3)
    packet[(bytes[i] << 8 | bytes[i + 1]) % packet.size()] = bytes[i + 2];
  PacketPacker packer;
  const PackedPacket packed =
      packer.pack({Packing::exact}, "application/x-polyhull-view", packet, 0);
  if (!packed.data.empty() && PacketUnpacker().unpack(1, packed.data) != packet) std::abort();
  return 0;
}
