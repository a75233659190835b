// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The packets of GStreamer's data protocol 1.0, as gdppay sends them: a header of 62 bytes,
/// big-endian, and a payload.
///
///     0   1  major version: 1          26  8  offset
///     1   1  minor version: 0          34  8  offset's end
///     2   1  flags: 1 the header       42  2  buffer's flags
///            has a checksum, 2 the     44  8  decoding time, ns
///            payload                   52  6  zero
///     4   2  kind                      58  2  header's checksum
///     6   4  payload's size            60  2  payload's checksum
///     10  8  presentation time, ns
///     18  8  duration, ns
///
/// Source: gst-plugins-bad, gst/gdp/dataprotocol.c, which is no public library. gdpdepay makes room
/// for whatever size such a header names and ends its pipeline where one is wrong; this is for
/// connections that come from anywhere.
#pragma once

#include <cstdint>

#include "mesh/view.h"
#include "wire/payload.h"

namespace polyhull {

inline constexpr std::size_t packet_header_size = 62;

enum class PacketKind : std::uint8_t {
  buffer,
  caps,   ///< the payload is their text
  event,  ///< the payload is the text of the event's structure; see PacketHeader::event
};

struct PacketHeader {
  PacketKind kind = PacketKind::buffer;
  std::uint16_t event = 0;          ///< GstEventType
  std::uint32_t size = 0;           ///< of the payload, bytes
  std::int64_t time = no_time;      ///< a buffer's presentation time, ns of its segment
  std::int64_t duration = no_time;  ///< ns
  bool payload_checked = false;     ///< whether payload_checksum is set
  std::uint16_t payload_checksum = 0;
};

/// Parses the first packet_header_size bytes of \p bytes, which may come from anywhere. Throws Error
/// (bad_input) for too few, another protocol or version, a wrong checksum, an unknown kind, and
/// times after latest_time.
PacketHeader read_packet_header(Bytes bytes);

/// Throws Error (bad_input) where \p header has a checksum that is not that of \p payload.
void check_packet_payload(const PacketHeader& header, Bytes payload);

}  // namespace polyhull
