// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/tracksrc/udp_socket.h"

#include <net/if.h>

#include <array>

#include "base/error.h"

namespace polyhull::element {
namespace {

constexpr std::size_t largest_datagram = 65536;
// Of a flood, those that are thrown away before listening begins anew.
constexpr int most_drained = 10000;

std::uint16_t local_port(GSocket* socket) {
  g_autoptr(GSocketAddress) local = g_socket_get_local_address(socket, nullptr);
  return local ? g_inet_socket_address_get_port(G_INET_SOCKET_ADDRESS(local)) : 0;
}

/// The sender of a datagram over IPv4.
void set_sender(Datagram& datagram, GSocketAddress* address) {
  if (!address || !G_IS_INET_SOCKET_ADDRESS(address)) return;
  auto* inet = G_INET_SOCKET_ADDRESS(address);
  const guint8* bytes = g_inet_address_to_bytes(g_inet_socket_address_get_address(inet));
  for (int i = 0; i < 4; ++i) datagram.address = datagram.address << 8 | bytes[i];
  datagram.port = g_inet_socket_address_get_port(inet);
}

}  // namespace

UdpSocket::UdpSocket(const std::string& address, std::uint16_t port,
                     const std::string& multicast_iface) {
  g_autoptr(GInetAddress) inet = g_inet_address_new_from_string(address.c_str());
  if (!inet || g_inet_address_get_family(inet) != G_SOCKET_FAMILY_IPV4)
    throw Error(Error::Kind::bad_input,
                "address={} is no IPv4 address. 0.0.0.0 listens on all of this machine's; a "
                "multicast group is for example 239.135.1.1.",
                address);
  // GIO would take any interface in the place of one that is not there.
  if (!multicast_iface.empty() && if_nametoindex(multicast_iface.c_str()) == 0)
    throw Error(
        Error::Kind::not_found,
        "multicast-iface={} is no network interface of this machine (`ip link` lists them).",
        multicast_iface);
  const bool group = g_inet_address_get_is_multicast(inet);
  g_autoptr(GError) error = nullptr;
  g_autoptr(GSocket) socket =
      g_socket_new(G_SOCKET_FAMILY_IPV4, G_SOCKET_TYPE_DATAGRAM, G_SOCKET_PROTOCOL_UDP, &error);
  if (!socket)
    throw Error(Error::Kind::io, "There is no UDP socket to be had: {}.", error->message);
  g_socket_set_blocking(socket, FALSE);
  // Several may listen to a group; a port that is another's must be refused.
  g_autoptr(GSocketAddress) local = g_inet_socket_address_new(inet, port);
  if (!g_socket_bind(socket, local, group, &error))
    throw Error(Error::Kind::io,
                "UDP port {} of {} cannot be listened on ({}). Choose another port, or end the "
                "program that has it; address must be this machine's.",
                port, address, error->message);
  if (group &&
      !g_socket_join_multicast_group(
          socket, inet, FALSE, multicast_iface.empty() ? nullptr : multicast_iface.c_str(), &error))
    throw Error(Error::Kind::io,
                "The multicast group {} cannot be joined on {} ({}). Set multicast-iface to the "
                "interface that the tracker is on.",
                address, multicast_iface.empty() ? "any interface" : multicast_iface,
                error->message);
  port_ = local_port(socket);
  socket_ = static_cast<GSocket*>(g_steal_pointer(&socket));
}

std::optional<Datagram> UdpSocket::receive(std::int64_t microseconds, GCancellable* cancellable) {
  g_autoptr(GError) error = nullptr;
  if (!g_socket_condition_timed_wait(socket_, G_IO_IN, microseconds, cancellable, &error)) {
    if (g_error_matches(error, G_IO_ERROR, G_IO_ERROR_TIMED_OUT) ||
        g_error_matches(error, G_IO_ERROR, G_IO_ERROR_CANCELLED))
      return {};
    throw Error(Error::Kind::io, "Listening on UDP port {} failed: {}.", port_, error->message);
  }
  std::array<gchar, largest_datagram> bytes;
  g_autoptr(GSocketAddress) sender = nullptr;
  const gssize size =
      g_socket_receive_from(socket_, &sender, bytes.data(), bytes.size(), cancellable, &error);
  if (size < 0) {
    // A datagram may be gone again: its checksum was wrong.
    if (g_error_matches(error, G_IO_ERROR, G_IO_ERROR_WOULD_BLOCK) ||
        g_error_matches(error, G_IO_ERROR, G_IO_ERROR_CANCELLED))
      return {};
    throw Error(Error::Kind::io, "Reading from UDP port {} failed: {}.", port_, error->message);
  }
  Datagram datagram;
  set_sender(datagram, sender);
  datagram.bytes.assign(bytes.begin(), bytes.begin() + size);
  return datagram;
}

void UdpSocket::drain() {
  for (int i = 0; i < most_drained && receive(0, nullptr); ++i) continue;
}

}  // namespace polyhull::element
