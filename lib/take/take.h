// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A take: what several streams carried during a performance, in one file.
///
/// The file is an SQLite database (application id "PHTK"), so that it has an index, stays whole when
/// the writer is killed, can be added to, and can be read by anybody:
///
///     stream (id, name)                 one per camera, mesh or sound
///     format (id, stream, caps)         what its packets are, as text; the last one said is true
///     packet (id, stream, format, time, duration, flags, hash, data)   in the order written
///     event  (id, stream, packet, name, value, hash)   what was announced before that packet
///     note   (name, value)              "rig", "settings" … : the text of the file of that name
///
/// with an index of packets by stream and time, one of events by stream and packet, and one of formats
/// by stream and caps, which is a second copy of them. Times are nanoseconds from the take's begin.
/// Packets of one instant are committed together: what a killed writer leaves lacks at most the last
/// one. `hash` tells packets that a damaged disk has changed. Where bit 32 of `flags` is set, `data` is
/// packed (packing.h); a take that has such a packet is of version 2, others of version 1.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace polyhull {

inline constexpr std::int64_t no_take_time = -1;

/// The event that is kept, and how many bytes it has at most.
inline constexpr char take_announcement[] = "polyhull-announcement";
inline constexpr std::size_t largest_announcement = 1 << 20;

/// Of packets, ns: sums of two are times, too.
inline constexpr std::int64_t largest_take_time = INT64_MAX / 4;

/// One stream of a take.
struct TakeStream {
  std::int64_t id = 0;
  std::string name;                 ///< of the camera or pad; one stream has it
  std::int64_t begin = 0, end = 0;  ///< of its first packet, and where its last one ends, ns
};

/// A text that belongs to a take.
struct TakeNote {
  std::string name;
  std::string value;
};

/// One buffer of a stream.
struct TakePacket {
  std::string caps;                      ///< what it is; as gst_caps_to_string() writes it
  std::int64_t time = 0;                 ///< ns from the take's begin, 0 or above
  std::int64_t duration = no_take_time;  ///< ns
  std::uint32_t flags = 0;               ///< kept as they are
  std::vector<std::uint8_t> data;
  std::size_t stored = 0;  ///< read: bytes that it takes in the file
  bool alone = true;       ///< read: it was unpacked without any other
  std::int64_t event = 0;  ///< read: by which TakeCursor::announcement() tells what is true of it
};

}  // namespace polyhull
