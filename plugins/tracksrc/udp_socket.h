// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A UDP socket of GIO that listens, on an address or in a multicast group.
#pragma once

#include <gio/gio.h>

#include <cstdint>
#include <optional>
#include <string>

#include "track/packet_file.h"

namespace polyhull::element {

class UdpSocket {
 public:
  /// Listens at once. \p port 0: a free one. Throws Error where \p address is no IPv4 address, the
  /// port is taken, or the group cannot be joined on \p multicast_iface (empty: any).
  UdpSocket(const std::string& address, std::uint16_t port, const std::string& multicast_iface);
  ~UdpSocket() { g_object_unref(socket_); }
  UdpSocket(const UdpSocket&) = delete;

  std::uint16_t port() const { return port_; }

  /// The next datagram, without a time; none after \p microseconds, or where \p cancellable is
  /// cancelled. Throws Error (io).
  std::optional<Datagram> receive(std::int64_t microseconds, GCancellable* cancellable);

  /// Forgets what has come so far.
  void drain();

 private:
  GSocket* socket_;
  std::uint16_t port_ = 0;
};

}  // namespace polyhull::element
