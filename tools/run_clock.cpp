// SPDX-License-Identifier: LGPL-2.1-or-later
#include "run_clock.h"

#include <gio/gio.h>
#include <gst/net/net.h>

#include <charconv>

#include "base/error.h"

using polyhull::Error;

namespace {

constexpr GstClockTime answer_within = 10 * GST_SECOND;

int port_of(const std::string& server) {
  const std::size_t colon = server.rfind(':');
  int port = 0;
  if (colon != std::string::npos && colon > 0) {
    const char* const end = server.data() + server.size();
    const auto [last, failure] = std::from_chars(server.data() + colon + 1, end, port);
    if (failure == std::errc() && last == end && port > 0 && port < 65536) return port;
  }
  throw Error(Error::Kind::bad_input,
              "--clock is '{}'; expected HOST:PORT, as of a machine that runs polyhull-run "
              "--clock-server PORT.",
              server);
}

/// Whether nobody has UDP port \p port. GStreamer's provider shares one with whoever is there: of two
/// clocks on one port, nobody knows which answers.
bool is_free(int port) {
  for (const GSocketFamily family : {G_SOCKET_FAMILY_IPV6, G_SOCKET_FAMILY_IPV4}) {
    g_autoptr(GSocket) socket =
        g_socket_new(family, G_SOCKET_TYPE_DATAGRAM, G_SOCKET_PROTOCOL_UDP, nullptr);
    if (socket == nullptr) continue;  // not every machine has IPv6
    g_autoptr(GInetAddress) any = g_inet_address_new_any(family);
    g_autoptr(GSocketAddress) address = g_inet_socket_address_new(any, static_cast<guint16>(port));
    if (!g_socket_bind(socket, address, FALSE, nullptr)) return false;
  }
  return true;
}

}  // namespace

GstObject* share_clock(GstElement* pipeline, int server_port, const std::string& server) {
  if (server_port == 0 && server.empty()) return nullptr;
  g_autoptr(GstClock) clock = nullptr;
  GstObject* provider = nullptr;
  if (server.empty()) {
    clock = gst_system_clock_obtain();
  } else {
    const int port = port_of(server);
    std::string host = server.substr(0, server.rfind(':'));
    // An IPv6 address has colons of its own: [fd00::1]:7480.
    if (host.size() > 2 && host.front() == '[' && host.back() == ']')
      host = host.substr(1, host.size() - 2);
    clock = gst_net_client_clock_new(nullptr, host.c_str(), port, 0);
    if (clock == nullptr || !gst_clock_wait_for_sync(clock, answer_within))
      throw Error(
          Error::Kind::io,
          "The clock at {} does not answer. Start polyhull-run --clock-server {} there, and "
          "let UDP on that port through.",
          server, port);
  }
  if (server_port != 0) {
    // IPv6's any address hears IPv4, too; not every machine has it.
    if (is_free(server_port))
      provider = GST_OBJECT(gst_net_time_provider_new(clock, "::", server_port));
    if (provider == nullptr && is_free(server_port))
      provider = GST_OBJECT(gst_net_time_provider_new(clock, nullptr, server_port));
    if (provider == nullptr)
      throw Error(Error::Kind::io,
                  "The clock cannot be served on UDP port {}: it is taken, or not allowed. Choose "
                  "another with --clock-server.",
                  server_port);
  }
  gst_pipeline_use_clock(GST_PIPELINE(pipeline), clock);
  // No start of one's own: running time is the clock's time, the same on all machines.
  gst_element_set_start_time(pipeline, GST_CLOCK_TIME_NONE);
  gst_element_set_base_time(pipeline, 0);
  return provider;
}
