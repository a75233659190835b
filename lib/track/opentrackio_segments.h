// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// OpenTrackIO's packets (SMPTE RIS OSVP, protocol 1.0), and the samples that several of them make.
///
///      byte  0 –  3  "OTrk"
///                 4  reserved
///                 5  encoding: 1 JSON, 2 CBOR
///            6 –  7  sequence number: of the sample, or of the packet (senders differ)
///            8 – 11  where in the sample this segment begins, in bytes
///           12 – 13  bit 15: the sample's last segment; the others: bytes of payload
///           14 – 15  Fletcher-16 over the 14 bytes before and the payload: modulo 255 or 256, the
///                    sum of sums first or the sum first (senders and the protocol's pages differ)
///           16 –     payload
///
/// All numbers are big-endian. Some senders leave the header out: a packet then is a sample, in JSON
/// (perhaps behind a byte order mark or white space) or in CBOR.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

namespace polyhull {

enum class OpenTrackIOEncoding { json, cbor };

struct OpenTrackIOPacket {
  OpenTrackIOEncoding encoding = OpenTrackIOEncoding::json;
  std::optional<std::uint16_t> sequence;  ///< none in a packet without header
  std::uint32_t offset = 0;
  bool last = true;
  std::span<const std::uint8_t> payload;  ///< within the bytes that were parsed

  bool is_whole() const { return offset == 0 && last; }  ///< a sample by itself
};

/// Whether \p bytes begin as a packet does, with or without header.
bool is_opentrackio(std::span<const std::uint8_t> bytes);

/// The packets of \p datagram: the samples of bare JSON that stand one behind another, a line each or
/// not, without white space and zeros behind the last; else what it is.
std::vector<std::span<const std::uint8_t>> opentrackio_packets(
    std::span<const std::uint8_t> datagram);

/// The packet that \p bytes hold: one with a header, or a whole sample as bare JSON, which begins with
/// "{", or bare CBOR, which begins with a map. Throws PacketError where bytes are missing or the checksum is wrong, Error (bad_input) for
/// anything else.
OpenTrackIOPacket parse_opentrackio_packet(std::span<const std::uint8_t> bytes);

/// \p bytes without the three that say of CBOR that it is CBOR (RFC 8949, 3.4.6), if they are there.
std::span<const std::uint8_t> without_cbor_mark(std::span<const std::uint8_t> bytes);

/// Fletcher-16 over \p header and then \p payload with sums modulo \p modulus, 255 or 256; the sum of
/// sums in the high byte.
std::uint16_t fletcher16(std::span<const std::uint8_t> header,
                         std::span<const std::uint8_t> payload, unsigned modulus);

/// A whole sample, still encoded.
struct OpenTrackIOBytes {
  OpenTrackIOEncoding encoding = OpenTrackIOEncoding::json;
  std::optional<std::uint16_t> sequence;  ///< the header's; none where it does not number samples
  std::vector<std::uint8_t> bytes;
};

/// The sample that \p packet is by itself.
OpenTrackIOBytes whole_sample(const OpenTrackIOPacket& packet);

/// Puts the segments of one sender together: in whatever order they come where all of a sample have
/// one number, in their own where each has the next one. Which it is shows with the first sample. One
/// sample is in work at a time: a segment of a later one gives it up.
class OpenTrackIOSegments {
 public:
  static constexpr std::size_t largest_sample = 65536;  ///< bytes
  static constexpr std::size_t most_parts = 1024;       ///< segments of one sample

  /// The sample that \p packet completes, if it does. Throws Error (bad_input), and gives the sample
  /// up, where segments contradict each other or the sample would be above `largest_sample`.
  std::optional<OpenTrackIOBytes> add(const OpenTrackIOPacket& packet);

  std::uint64_t incomplete() const { return incomplete_; }  ///< samples given up
  std::uint64_t late() const { return late_; }  ///< segments of samples that were given up

 private:
  enum class Numbered { unknown, samples, segments };
  bool continues(const OpenTrackIOPacket& packet) const;
  void begin(const OpenTrackIOPacket& packet);
  void keep(const OpenTrackIOPacket& packet);
  std::optional<OpenTrackIOBytes> take_if_whole();

  bool in_work_ = false;
  Numbered numbered_ = Numbered::unknown;
  std::optional<std::uint16_t> sequence_;  // of the sample in work, or of the last one: its first
  std::uint16_t last_number_ = 0;          // of its segments
  OpenTrackIOEncoding encoding_ = OpenTrackIOEncoding::json;
  std::optional<std::size_t> size_;                         // known once the last segment is here
  std::map<std::size_t, std::vector<std::uint8_t>> parts_;  // by offset
  std::uint64_t incomplete_ = 0, late_ = 0;
};

}  // namespace polyhull
