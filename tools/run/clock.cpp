// SPDX-License-Identifier: LGPL-2.1-or-later
#include "run/clock.h"

#include <gio/gio.h>
#include <gst/net/net.h>

#include <charconv>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <string_view>
#include <thread>

#include "base/error.h"

using polyhull::Error;

namespace {

constexpr GstClockTime answer_within = 10 * GST_SECOND;
/// Running time by PTP counts from the year 2020: half a century since 1970 is more than the elements
/// take for one. A grandmaster whose time is before that has one of its own, with a zero of its own.
constexpr GstClockTime ptp_zero = 1'577'836'800 * GST_SECOND;

/// The whole number in \p text from \p least to \p most.
std::optional<int> number_in(std::string_view text, int least, int most) {
  int number = 0;
  const char* const end = text.data() + text.size();
  const auto [last, failure] = std::from_chars(text.data(), end, number);
  if (failure != std::errc() || last != end || number < least || number > most) return {};
  return number;
}

[[noreturn]] void fail_name(const std::string& server) {
  throw Error(Error::Kind::bad_input,
              "--clock is '{}'; expected HOST:PORT, as of a machine that runs polyhull-run "
              "--clock-server PORT, or ptp or ptp:DOMAIN (0 to 255).",
              server);
}

GstClock* network_clock(const std::string& server) {
  const std::size_t colon = server.rfind(':');
  if (colon == std::string::npos || colon == 0) fail_name(server);
  const auto port = number_in(std::string_view(server).substr(colon + 1), 1, 65535);
  if (!port) fail_name(server);
  std::string host = server.substr(0, colon);
  // An IPv6 address has colons of its own: [fd00::1]:7480.
  if (host.size() > 2 && host.front() == '[' && host.back() == ']')
    host = host.substr(1, host.size() - 2);
  g_autoptr(GstClock) clock = gst_net_client_clock_new(nullptr, host.c_str(), *port, 0);
  if (clock == nullptr || !gst_clock_wait_for_sync(clock, answer_within))
    throw Error(Error::Kind::io,
                "The clock at {} does not answer. Start polyhull-run --clock-server {} there, and "
                "let UDP on that port through.",
                server, *port);
  return GST_CLOCK(gst_object_ref(clock));
}

/// Whether PTP can be followed. Where its helper is not to be found, GStreamer 1.22 waits forever.
bool begin_ptp() {
  const auto begun = std::make_shared<std::promise<bool>>();
  std::future<bool> result = begun->get_future();
  std::thread([begun] {
    begun->set_value(gst_ptp_init(GST_PTP_CLOCK_ID_NONE, nullptr) != FALSE);
  }).detach();
  return result.wait_for(std::chrono::nanoseconds(answer_within)) == std::future_status::ready &&
         result.get();
}

/// The clock that a PTP grandmaster gives to the domain that \p server, "ptp" or "ptp:DOMAIN", names.
GstClock* ptp_clock(const std::string& server) {
  const auto domain = server == "ptp" ? 0 : number_in(std::string_view(server).substr(4), 0, 255);
  if (!domain) fail_name(server);
  if (!begin_ptp())
    throw Error(
        Error::Kind::unsupported,
        "PTP cannot be followed: GStreamer's gst-ptp-helper does not run here. It comes with "
        "GStreamer, needs UDP ports 319 and 320 and the right to use them (sudo setcap "
        "cap_net_bind_service,cap_net_admin=ep on that file), and a network interface that "
        "is up and has multicast.");
  g_autoptr(GstClock) clock = gst_ptp_clock_new(nullptr, static_cast<guint>(*domain));
  if (clock == nullptr || !gst_clock_wait_for_sync(clock, answer_within))
    throw Error(Error::Kind::io,
                "No PTP clock is heard in domain {} within ten seconds. Look at the grandmaster's "
                "domain (ptp:DOMAIN), that it speaks PTP version 2 over UDP/IPv4 with end-to-end "
                "delays, and that this machine has a route to 224.0.1.129 (ip route add "
                "224.0.0.0/4 dev DEVICE) and lets UDP ports 319 and 320 through.",
                *domain);
  return GST_CLOCK(gst_object_ref(clock));
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
    clock =
        server == "ptp" || server.starts_with("ptp:") ? ptp_clock(server) : network_clock(server);
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
  const bool since_zero = GST_IS_PTP_CLOCK(clock) && gst_clock_get_time(clock) > ptp_zero;
  gst_element_set_base_time(pipeline, since_zero ? ptp_zero : 0);
  return provider;
}
