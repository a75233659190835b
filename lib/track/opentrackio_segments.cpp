// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/opentrackio_segments.h"

#include <algorithm>
#include <array>
#include <iterator>

#include "base/error.h"
#include "track/packet_error.h"

namespace polyhull {
namespace {

constexpr std::array<std::uint8_t, 4> identifier{'O', 'T', 'r', 'k'};
constexpr std::size_t header_size = 16, checksummed = 14;

OpenTrackIOEncoding encoding_of(std::uint8_t number) {
  if (number == 1) return OpenTrackIOEncoding::json;
  if (number == 2) return OpenTrackIOEncoding::cbor;
  throw opentrackio_error(fmt::format("encoding {} is neither 1 (JSON) nor 2 (CBOR)", number));
}

/// \p bytes without a byte order mark and white space before it.
std::span<const std::uint8_t> text_of(std::span<const std::uint8_t> bytes) {
  constexpr std::array<std::uint8_t, 3> mark{0xEF, 0xBB, 0xBF};
  if (bytes.size() >= mark.size() && std::equal(mark.begin(), mark.end(), bytes.begin()))
    bytes = bytes.subspan(mark.size());
  const auto begins = std::find_if(bytes.begin(), bytes.end(), [](std::uint8_t byte) {
    return byte != ' ' && byte != '\t' && byte != '\n' && byte != '\r';
  });
  return bytes.subspan(static_cast<std::size_t>(begins - bytes.begin()));
}

bool is_json(std::span<const std::uint8_t> bytes) {
  const auto text = text_of(bytes);
  return !text.empty() && text[0] == '{';
}

/// A map's first byte (RFC 8949, 3.1): its size in it, in up to eight bytes more, or nowhere.
bool is_cbor(std::span<const std::uint8_t> bytes) {
  const auto content = without_cbor_mark(bytes);
  return !content.empty() && ((content[0] >= 0xA0 && content[0] <= 0xBB) || content[0] == 0xBF);
}

// Numbers of two bytes; 0 is left out by those who count from 1.
bool is_next(std::uint16_t number, std::uint16_t last) {
  return number == static_cast<std::uint16_t>(last + 1) || (last == 65535 && number == 1);
}

}  // namespace

std::uint16_t fletcher16(std::span<const std::uint8_t> header,
                         std::span<const std::uint8_t> payload, unsigned modulus) {
  unsigned sum = 0, sum_of_sums = 0;
  for (const auto bytes : {header, payload}) {
    for (const std::uint8_t byte : bytes) {
      sum = (sum + byte) % modulus;
      sum_of_sums = (sum_of_sums + sum) % modulus;
    }
  }
  return static_cast<std::uint16_t>(sum_of_sums << 8 | sum);
}

std::span<const std::uint8_t> without_cbor_mark(std::span<const std::uint8_t> bytes) {
  constexpr std::array<std::uint8_t, 3> mark{0xD9, 0xD9, 0xF7};
  const bool marked =
      bytes.size() >= mark.size() && std::equal(mark.begin(), mark.end(), bytes.begin());
  return marked ? bytes.subspan(mark.size()) : bytes;
}

bool is_opentrackio(std::span<const std::uint8_t> bytes) {
  return (!bytes.empty() && bytes[0] == identifier[0]) || is_json(bytes) || is_cbor(bytes);
}

std::vector<std::span<const std::uint8_t>> opentrackio_packets(
    std::span<const std::uint8_t> datagram) {
  if (!is_json(datagram)) return {datagram};
  std::vector<std::span<const std::uint8_t>> samples;
  std::size_t begin = 0, depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < datagram.size(); ++i) {
    const std::uint8_t c = datagram[i];
    if (c == '"') in_string = !in_string;
    if (in_string) {
      i += c == '\\';
    } else if (c == '{') {
      ++depth;
    } else if (c == '}' && depth > 0 && --depth == 0) {
      samples.push_back(datagram.subspan(begin, i + 1 - begin));
      begin = i + 1;
    }
  }
  const auto rest = text_of(datagram.subspan(begin));
  if (samples.empty() || std::any_of(rest.begin(), rest.end(), [](auto byte) { return byte != 0; }))
    samples.push_back(datagram.subspan(begin));
  return samples;
}

OpenTrackIOPacket parse_opentrackio_packet(std::span<const std::uint8_t> bytes) {
  OpenTrackIOPacket packet;
  if (is_json(bytes)) {
    packet.payload = text_of(bytes);
    return packet;
  }
  if (is_cbor(bytes)) {
    packet.encoding = OpenTrackIOEncoding::cbor;
    packet.payload = bytes;
    return packet;
  }
  if (bytes.size() < header_size)
    throw PacketError(PacketError::Fault::truncated,
                      "OpenTrackIO: a packet of {} bytes is shorter than a header.", bytes.size());
  if (!std::equal(identifier.begin(), identifier.end(), bytes.begin()))
    throw opentrackio_error(
        "a packet begins neither with \"OTrk\" nor as a sample in JSON or CBOR does");
  packet.encoding = encoding_of(bytes[5]);
  packet.sequence = static_cast<std::uint16_t>(big_endian(bytes.subspan(6, 2)));
  packet.offset = big_endian(bytes.subspan(8, 4));
  const std::uint32_t length = big_endian(bytes.subspan(12, 2));
  packet.last = length & 0x8000;
  packet.payload = bytes.subspan(header_size);
  if ((length & 0x7FFF) != packet.payload.size())
    throw PacketError(PacketError::Fault::truncated,
                      "OpenTrackIO: the header promises {} bytes of payload, {} came.",
                      length & 0x7FFF, packet.payload.size());
  const std::uint32_t sent = big_endian(bytes.subspan(checksummed, 2));
  const auto header = bytes.first(checksummed);
  for (const unsigned modulus : {255u, 256u}) {
    const std::uint32_t sum = fletcher16(header, packet.payload, modulus);
    if (sent == sum || sent == (sum >> 8 | (sum & 0xFF) << 8)) return packet;
  }
  throw PacketError(PacketError::Fault::checksum, "OpenTrackIO: the checksum is wrong.");
}

OpenTrackIOBytes whole_sample(const OpenTrackIOPacket& packet) {
  return {packet.encoding, packet.sequence, {packet.payload.begin(), packet.payload.end()}};
}

std::optional<OpenTrackIOBytes> OpenTrackIOSegments::add(const OpenTrackIOPacket& packet) {
  if (!packet.sequence) return whole_sample(packet);
  if (continues(packet)) {
    last_number_ = *packet.sequence;
    keep(packet);
    return take_if_whole();
  }
  // Where each segment has its own number, one whose neighbour is missing is of nobody knows which
  // sample.
  const bool of_this = in_work_ && packet.sequence == sequence_;
  if (numbered_ == Numbered::segments && packet.offset != 0 && !of_this) {
    ++late_;
    return {};
  }
  if (!sequence_ || *packet.sequence != *sequence_) {
    // Numbers wrap. A little back is before; further back is a sender that began anew. A whole sample
    // that comes late is still a sample (its place in time is the track's business); a part of one is
    // of no use.
    const int step = sequence_ ? static_cast<std::int16_t>(*packet.sequence - *sequence_) : 1;
    const bool before = step < 0 && step >= -furthest_detour;
    if (before && packet.is_whole()) return whole_sample(packet);
    // A sender that begins anew counts from anywhere, with the first segment of a sample.
    if (before && (in_work_ || packet.offset != 0)) {
      ++late_;
      return {};
    }
    begin(packet);
  } else if (!in_work_) {
    if (packet.offset != 0 || !packet.last) return {};  // a segment sent twice
    begin(packet);
  }
  keep(packet);
  return take_if_whole();
}

/// Whether \p packet is the next segment of the sample in work, under the next number.
bool OpenTrackIOSegments::continues(const OpenTrackIOPacket& packet) const {
  if (!in_work_ || size_ || parts_.empty() || numbered_ == Numbered::samples) return false;
  const auto& [begins, part] = *parts_.rbegin();
  return packet.offset == begins + part.size() && is_next(*packet.sequence, last_number_);
}

void OpenTrackIOSegments::begin(const OpenTrackIOPacket& packet) {
  if (in_work_) {
    ++incomplete_;
    numbered_ = Numbered::unknown;  // it may be another sender by now
  }
  in_work_ = true;
  sequence_ = packet.sequence;
  last_number_ = *packet.sequence;
  encoding_ = packet.encoding;
  size_.reset();
  parts_.clear();
}

void OpenTrackIOSegments::keep(const OpenTrackIOPacket& packet) {
  const std::size_t begins = packet.offset, ends = begins + packet.payload.size();
  const auto fail = [this](const std::string& what) {
    in_work_ = false;
    ++incomplete_;
    parts_.clear();
    return opentrackio_error(what);
  };
  if (ends > largest_sample)
    throw fail(
        fmt::format("a sample of {} bytes or more; at most {} are read", ends, largest_sample));
  if (packet.encoding != encoding_) throw fail("segments of one sample differ in encoding");
  if (packet.last && size_ && *size_ != ends) throw fail("a sample has two ends");
  if (packet.last) size_ = ends;
  if (size_ && ends > *size_) throw fail("a segment lies beyond the end of its sample");
  if (packet.payload.empty()) return;
  const auto after = parts_.lower_bound(begins);
  if (after != parts_.end() && after->first == begins) return;  // sent twice
  // Now, not at the end: what overlaps could be many times a sample.
  const auto end_of = [](const auto& part) { return part.first + part.second.size(); };
  if ((after != parts_.end() && after->first < ends) ||
      (after != parts_.begin() && end_of(*std::prev(after)) > begins))
    throw fail("segments of one sample overlap");
  if (parts_.size() == most_parts) throw fail("a sample of too many segments");
  parts_.try_emplace(after, begins, packet.payload.begin(), packet.payload.end());
}

std::optional<OpenTrackIOBytes> OpenTrackIOSegments::take_if_whole() {
  if (!size_) return {};
  OpenTrackIOBytes sample{encoding_, sequence_, {}};
  for (const auto& [begins, part] : parts_) {
    if (begins != sample.bytes.size()) return {};  // a gap
    sample.bytes.insert(sample.bytes.end(), part.begin(), part.end());
  }
  if (sample.bytes.size() != *size_) return {};
  if (parts_.size() > 1) {
    numbered_ = last_number_ == *sequence_ ? Numbered::samples : Numbered::segments;
    if (numbered_ == Numbered::segments) sample.sequence.reset();  // it would count segments
  }
  in_work_ = false;
  parts_.clear();
  return sample;
}

}  // namespace polyhull
