// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/packet_file.h"

#include <arpa/inet.h>
#include <pcap/pcap.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "base/error.h"
#include "base/nanoseconds.h"
#include "track/packet_error.h"

namespace polyhull {
namespace {

constexpr std::size_t ip_header = 20, ipv6_header = 40, udp_header = 8;
constexpr std::uint8_t udp = 17;
constexpr int largest_packet = 65535;
// Nobody's pipeline runs that long, and no capture is that old.
constexpr std::int64_t a_year = 365 * 24 * 3600 * second;

void append(std::vector<std::uint8_t>& to, std::uint32_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) to.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

// Where IP begins in a frame of the link layer; nullopt: there is none.
std::optional<std::size_t> ip_begins(int link, std::span<const std::uint8_t> frame) {
  constexpr std::uint32_t tagged = 0x8100;
  const auto is_ip = [](std::uint32_t type) { return type == 0x0800 || type == 0x86DD; };
  std::size_t type = 0;
  if (link == DLT_RAW || link == DLT_IPV4 || link == DLT_IPV6) return 0;
  // A system's number of the protocol in its own order of bytes; the packet says which it is.
  if (link == DLT_NULL || link == DLT_LOOP) return std::min<std::size_t>(4, frame.size());
  if (link == DLT_EN10MB) type = 12;
  if (link == DLT_LINUX_SLL) type = 14;
  if (link == DLT_LINUX_SLL2)
    return frame.size() > 20 && is_ip(big_endian(frame.first(2))) ? std::optional<std::size_t>(20)
                                                                  : std::nullopt;
  if (link == DLT_EN10MB && frame.size() > 18 && big_endian(frame.subspan(type, 2)) == tagged)
    type += 4;
  if (frame.size() < type + 2 || !is_ip(big_endian(frame.subspan(type, 2)))) return {};
  return type + 2;
}

bool is_readable(int link) {
  const auto links = {DLT_RAW,  DLT_IPV4, DLT_IPV6,      DLT_EN10MB,
                      DLT_NULL, DLT_LOOP, DLT_LINUX_SLL, DLT_LINUX_SLL2};
  return std::find(links.begin(), links.end(), link) != links.end();
}

// A datagram from UDP's header on, which padding may follow; its address is left open.
std::optional<Datagram> datagram_in(std::span<const std::uint8_t> whole) {
  if (whole.size() < udp_header) return {};
  const std::size_t length = big_endian(whole.subspan(4, 2));
  if (length < udp_header || length > whole.size()) return {};
  Datagram datagram;
  datagram.port = static_cast<std::uint16_t>(big_endian(whole.first(2)));
  const auto payload = whole.subspan(udp_header, length - udp_header);
  datagram.bytes.assign(payload.begin(), payload.end());
  return datagram;
}

std::optional<Datagram> datagram_of_ipv6(std::span<const std::uint8_t> packet) {
  if (packet.size() < ipv6_header || packet[6] != udp) return {};
  std::optional<Datagram> datagram = datagram_in(packet.subspan(ipv6_header));
  char text[INET6_ADDRSTRLEN] = "";
  if (datagram) datagram->ipv6 = inet_ntop(AF_INET6, packet.data() + 8, text, sizeof text);
  return datagram;
}

// The datagram in an IP packet.
std::optional<Datagram> datagram_of(std::span<const std::uint8_t> packet) {
  if (!packet.empty() && packet[0] >> 4 == 6) return datagram_of_ipv6(packet);
  if (packet.size() < ip_header || packet[0] >> 4 != 4 || packet[9] != udp) return {};
  const std::size_t header = 4u * (packet[0] & 15);
  const bool in_pieces = (big_endian(packet.subspan(6, 2)) & 0x3FFF) != 0;
  if (in_pieces || header < ip_header || packet.size() < header) return {};
  std::optional<Datagram> datagram = datagram_in(packet.subspan(header));
  if (datagram) datagram->address = big_endian(packet.subspan(12, 4));
  return datagram;
}

}  // namespace

std::string Datagram::sender_host() const {
  if (!ipv6.empty()) return ipv6;
  return fmt::format("{}.{}.{}.{}", address >> 24, address >> 16 & 255, address >> 8 & 255,
                     address & 255);
}

std::string Datagram::sender() const {
  return fmt::format(fmt::runtime(ipv6.empty() ? "{}:{}" : "[{}]:{}"), sender_host(), port);
}

void PacketRecorder::Close::operator()(pcap* file) const {
  pcap_close(file);
}
void PacketRecorder::Close::operator()(pcap_dumper* file) const {
  pcap_dump_close(file);
}

PacketRecorder::PacketRecorder(const std::string& path, std::uint16_t port)
    : path_(path),
      port_(port),
      format_(pcap_open_dead_with_tstamp_precision(DLT_RAW, largest_packet,
                                                   PCAP_TSTAMP_PRECISION_NANO)) {
  if (!format_) throw Error(Error::Kind::io, "There is no memory to record packets with.");
  file_.reset(pcap_dump_open(format_.get(), path.c_str()));
  if (!file_)
    throw Error(Error::Kind::io,
                "Packets cannot be recorded: {}. Name a file in a folder that can be written to.",
                pcap_geterr(format_.get()));
}

void PacketRecorder::write(const Datagram& datagram) {
  const std::size_t payload =
      std::min(datagram.bytes.size(), largest_packet - ip_header - udp_header);
  std::vector<std::uint8_t> packet{0x45, 0};
  append(packet, static_cast<std::uint32_t>(ip_header + udp_header + payload), 2);
  append(packet, 0, 4);  // in one piece
  packet.push_back(64);  // may travel so many hops
  packet.push_back(udp);
  append(packet, 0, 2);
  append(packet, datagram.address, 4);
  append(packet, 0, 4);
  // The sum of the header's words, with carries added, is all ones.
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < ip_header; i += 2)
    sum += big_endian(std::span<const std::uint8_t>(packet).subspan(i, 2));
  sum = (sum & 0xFFFF) + (sum >> 16);
  sum = ~(sum + (sum >> 16)) & 0xFFFF;
  packet[10] = static_cast<std::uint8_t>(sum >> 8);
  packet[11] = static_cast<std::uint8_t>(sum);
  append(packet, datagram.port, 2);
  append(packet, port_, 2);
  append(packet, static_cast<std::uint32_t>(udp_header + payload), 2);
  append(packet, 0, 2);  // no checksum, as UDP over IPv4 allows
  packet.insert(packet.end(), datagram.bytes.begin(),
                datagram.bytes.begin() + static_cast<std::ptrdiff_t>(payload));
  pcap_pkthdr header{};
  header.ts.tv_sec = datagram.time_ns / second;
  header.ts.tv_usec = datagram.time_ns % second;  // nanoseconds in such a file
  header.caplen = header.len = static_cast<bpf_u_int32>(packet.size());
  pcap_dump(reinterpret_cast<u_char*>(file_.get()), &header, packet.data());
  if (pcap_dump_flush(file_.get()) != 0)
    throw Error(Error::Kind::io,
                "Writing '{}' failed: recording ends. Look whether the disk is full.", path_);
}

void PacketRecording::Close::operator()(pcap* file) const {
  pcap_close(file);
}

PacketRecording::PacketRecording(const std::string& path) : path_(path) {
  // libpcap takes "-" for the standard input.
  std::error_code error;
  if (!std::filesystem::exists(path, error))
    throw Error(Error::Kind::not_found, "There is no recorded track '{}'.", path);
  char why[PCAP_ERRBUF_SIZE] = "";
  file_.reset(
      pcap_open_offline_with_tstamp_precision(path.c_str(), PCAP_TSTAMP_PRECISION_NANO, why));
  if (!file_)
    throw Error(Error::Kind::bad_input,
                "'{}' is no recorded track: {}. A file of tracksrc's record, tcpdump or Wireshark "
                "is expected.",
                path, why);
  if (!is_readable(pcap_datalink(file_.get())))
    throw Error(Error::Kind::unsupported,
                "'{}' holds packets of a link that is not read; Ethernet, Linux's \"any\", "
                "loopback (Npcap, macOS) and raw IP are.",
                path);
}

std::optional<Datagram> PacketRecording::next() {
  while (file_) {
    pcap_pkthdr* header = nullptr;
    const u_char* bytes = nullptr;
    const int found = pcap_next_ex(file_.get(), &header, &bytes);
    if (found == PCAP_ERROR_BREAK) {
      file_.reset();
      return {};
    }
    if (found != 1) {
      const std::string why = pcap_geterr(file_.get());
      file_.reset();
      throw Error(Error::Kind::bad_input,
                  "The recorded track '{}' is damaged: {}. What came before was used.", path_, why);
    }
    const std::span<const std::uint8_t> frame(bytes, header->caplen);
    const auto begin = ip_begins(pcap_datalink(file_.get()), frame);
    auto datagram = begin ? datagram_of(frame.subspan(*begin)) : std::nullopt;
    // Times of which nobody knows what they mean.
    const bool timed = header->ts.tv_sec >= 0 && header->ts.tv_sec < (std::int64_t{1} << 33) &&
                       header->ts.tv_usec >= 0 && header->ts.tv_usec < second;
    if (!datagram || !timed) {
      ++skipped_;
      continue;
    }
    const std::int64_t time = header->ts.tv_sec * second + header->ts.tv_usec;
    if (!origin_ns_) origin_ns_ = time < a_year ? 0 : time;
    datagram->time_ns = std::max<std::int64_t>(0, time - *origin_ns_);
    return datagram;
  }
  return {};
}

}  // namespace polyhull
