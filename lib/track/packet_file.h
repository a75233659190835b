// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Datagrams with the times at which they came, in files of libpcap: what tcpdump and Wireshark write
/// and read (docs/formats.md).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

struct pcap;
struct pcap_dumper;

namespace polyhull {

/// A UDP datagram.
struct Datagram {
  std::int64_t time_ns = 0;
  std::uint32_t address = 0;  ///< the sender's; the first number of 127.0.0.1 in the highest byte
  std::uint16_t port = 0;     ///< likewise
  std::vector<std::uint8_t> bytes;
  std::string ipv6;  ///< the sender's address in its stead; empty: over IPv4

  std::string sender_host() const;  ///< "127.0.0.1", "fe80::1"
  std::string sender() const;       ///< "127.0.0.1:40000", "[fe80::1]:40000"
};

/// Writes a file; what is written stays readable if the program ends at any moment.
class PacketRecorder {
 public:
  /// Makes \p path, or empties it; \p port is where the datagrams came to. Throws Error (io).
  PacketRecorder(const std::string& path, std::uint16_t port);

  /// Appends \p datagram, whose time is 0 or above. Throws Error (io), after which nothing more is to
  /// be written.
  void write(const Datagram& datagram);

 private:
  struct Close {
    void operator()(pcap* file) const;
    void operator()(pcap_dumper* file) const;
  };
  std::string path_;
  std::uint16_t port_;
  std::unique_ptr<pcap, Close> format_;
  std::unique_ptr<pcap_dumper, Close> file_;
};

/// Reads a file of PacketRecorder, tcpdump or Wireshark (pcap, pcapng; Ethernet, Linux's "any",
/// the loopback of Npcap, macOS and BSD, or raw IP).
class PacketRecording {
 public:
  /// Throws Error (not_found, bad_input, unsupported).
  explicit PacketRecording(const std::string& path);

  /// The next UDP datagram; none at the end. Other packets, pieces and datagrams behind further headers
  /// of IPv6 are passed over. Times are the file's where they count from a beginning, as PacketRecorder's do; where they
  /// are dates, they count from the first. Throws Error (bad_input) where the file is damaged or cut
  /// off, after which there is no more to be had.
  std::optional<Datagram> next();

  std::uint64_t skipped() const { return skipped_; }  ///< packets passed over

 private:
  struct Close {
    void operator()(pcap* file) const;
  };
  std::string path_;
  std::unique_ptr<pcap, Close> file_;
  std::optional<std::int64_t> origin_ns_;
  std::uint64_t skipped_ = 0;
};

}  // namespace polyhull
