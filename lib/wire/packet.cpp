// SPDX-License-Identifier: LGPL-2.1-or-later
#include "wire/packet.h"

#include <array>

#include "base/error.h"

namespace polyhull {
namespace {

constexpr std::uint64_t buffers = 1, caps = 2, first_event = 64;
constexpr std::uint8_t header_checked = 1, payload_checked = 2;

std::uint64_t number(Bytes bytes, std::size_t offset, std::size_t size) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes.subspan(offset, size)) value = value << 8 | byte;
  return value;
}

/// CRC-16/GENIBUS (polynomial 0x1021, all ones before and inverted after), by bytes.
constexpr auto remainders = [] {
  std::array<std::uint16_t, 256> table{};
  for (unsigned byte = 0; byte < 256; ++byte) {
    unsigned value = byte << 8;
    for (int bit = 0; bit < 8; ++bit) value = value << 1 ^ (value & 0x8000 ? 0x1021 : 0);
    table[byte] = static_cast<std::uint16_t>(value);
  }
  return table;
}();

std::uint16_t checksum(Bytes bytes) {
  unsigned value = 0xffff;
  for (const std::uint8_t byte : bytes)
    value = (value << 8 ^ remainders[(value >> 8 ^ byte) & 0xff]) & 0xffff;
  return static_cast<std::uint16_t>(~value);
}

std::int64_t time_of(std::uint64_t value) {
  if (value == ~std::uint64_t{0}) return no_time;
  if (value > static_cast<std::uint64_t>(latest_time))
    throw Error(Error::Kind::bad_input, "A packet's time is {} ns, after the year 2065.", value);
  return static_cast<std::int64_t>(value);
}

}  // namespace

PacketHeader read_packet_header(Bytes bytes) {
  if (bytes.size() < packet_header_size)
    throw Error(Error::Kind::bad_input, "A packet's header has {} bytes; it takes {}.",
                bytes.size(), packet_header_size);
  if (bytes[0] != 1 || bytes[1] != 0)
    throw Error(Error::Kind::bad_input,
                "What comes is not GStreamer's data protocol 1.0; the sender must end in gdppay "
                "and viewserversink or tcpserversink.");
  if ((bytes[2] & header_checked) != 0 && number(bytes, 58, 2) != checksum(bytes.first(58)))
    throw Error(Error::Kind::bad_input, "A packet's header is damaged: its checksum is wrong.");
  PacketHeader header;
  const std::uint64_t kind = number(bytes, 4, 2);
  if (kind == buffers) {
    header.kind = PacketKind::buffer;
  } else if (kind == caps) {
    header.kind = PacketKind::caps;
  } else if (kind >= first_event) {
    header.kind = PacketKind::event;
    header.event = static_cast<std::uint16_t>(kind - first_event);
  } else {
    throw Error(Error::Kind::bad_input, "A packet is of kind {}, which there is not.", kind);
  }
  header.size = static_cast<std::uint32_t>(number(bytes, 6, 4));
  header.payload_checked = (bytes[2] & payload_checked) != 0;
  header.payload_checksum = static_cast<std::uint16_t>(number(bytes, 60, 2));
  if (header.kind == PacketKind::buffer) {
    header.time = time_of(number(bytes, 10, 8));
    header.duration = time_of(number(bytes, 18, 8));
  }
  return header;
}

void check_packet_payload(const PacketHeader& header, Bytes payload) {
  if (header.payload_checked && header.payload_checksum != checksum(payload))
    throw Error(Error::Kind::bad_input, "A packet is damaged: its payload's checksum is wrong.");
}

}  // namespace polyhull
