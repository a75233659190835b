// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What sends a tracker's packets over UDP on this machine.
#pragma once

#include <arpa/inet.h>
#include <gst/check/gstcheck.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <span>

namespace polyhull::test {

class Tracker {
 public:
  explicit Tracker(const char* host = "127.0.0.1") : socket_(socket(AF_INET, SOCK_DGRAM, 0)) {
    const sockaddr_in own = address(host, 0);
    fail_unless(bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof own) == 0);
    const in_addr interface = own.sin_addr;
    fail_unless(setsockopt(socket_, IPPROTO_IP, IP_MULTICAST_IF, &interface, sizeof interface) ==
                0);
  }
  ~Tracker() { close(socket_); }
  Tracker(const Tracker&) = delete;

  void send(guint64 port, std::span<const std::uint8_t> bytes, const char* to = "127.0.0.1") const {
    const sockaddr_in target = address(to, static_cast<std::uint16_t>(port));
    fail_unless_equals_int(sendto(socket_, bytes.data(), bytes.size(), 0,
                                  reinterpret_cast<const sockaddr*>(&target), sizeof target),
                           static_cast<gssize>(bytes.size()));
  }

 private:
  static sockaddr_in address(const char* host, std::uint16_t port) {
    sockaddr_in result{};
    result.sin_family = AF_INET;
    result.sin_port = htons(port);
    fail_unless(inet_pton(AF_INET, host, &result.sin_addr) == 1);
    return result;
  }
  int socket_;
};

}  // namespace polyhull::test
