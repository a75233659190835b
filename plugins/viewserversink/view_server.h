// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Serves one stream of packets to clients over TCP, to those that may have it. Each has a thread of
/// its own, so that the stream and the others wait for none.
#pragma once

#include <gio/gio.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "plugins/viewserversink/allowed_addresses.h"
#include "plugins/viewserversink/served_client.h"
#include "plugins/viewserversink/settings.h"

namespace polyhull::element {

class ViewServer {
 public:
  /// So many prove by TLS who they are at once; of more, the address that has the most of them gives
  /// up its first one: connections that say nothing, or one machine that makes many, keep nobody out.
  /// Fewer than the ten threads that GIO has for it.
  static constexpr std::size_t most_handshakes = 8;

  /// Told of each client that is served, or not any more, or refused, on any thread and without a
  /// lock; \p event is one of clients, clients-closed, clients-slow, refused-addresses, refused-full,
  /// refused-keys, refused-names, refused-resources, refused-noise and handshakes-late
  /// (viewserversink says which counters they are); \p why is what GIO or the system says, or empty.
  using Listener =
      std::function<void(const char* event, const std::string& address, const std::string& why)>;

  /// Told the lines that trusted clients say, on their threads and without a lock; none: nobody hears
  /// them.
  using Settings = std::function<void(const std::string& address, const std::string& line)>;

  /// Listens. Throws Error where the address cannot be used, or \p settings' names of files or
  /// addresses.
  ViewServer(const ViewServerSettings& settings, Listener listener, Settings said);
  ~ViewServer();
  ViewServer(const ViewServer&) = delete;

  int port() const { return port_; }

  /// What comes first to every new client, from now on.
  void set_head(std::vector<Ref<GstBuffer>> head);

  /// Sends \p packet to all.
  void send(GstBuffer* packet, const ViewServerSettings& settings);

  /// Whether all clients have all that was sent.
  bool all_have_all() const;

  /// How many are served now, and bytes that all have taken.
  std::size_t clients() const;
  std::uint64_t bytes() const;

 private:
  void accept();
  void welcome(Ref<GSocketConnection> connection);
  bool admit(ServedClient& client);
  std::size_t served() const;
  void make_way(const std::string& network, std::vector<std::unique_ptr<ServedClient>>& removed);
  void remove_ended(std::vector<std::unique_ptr<ServedClient>>& removed);
  void tell(std::vector<std::unique_ptr<ServedClient>>& removed);

  const AllowedAddresses allowed_;
  const TlsIdentity identity_;
  const Listener listener_;
  const Settings said_;
  Ref<GSocketListener> socket_{g_socket_listener_new()};
  Ref<GCancellable> cancel_{g_cancellable_new()};
  int port_ = 0;
  mutable std::mutex mutex_;  // protects the four below
  ViewServerSettings settings_;
  std::vector<Ref<GstBuffer>> head_;
  std::vector<std::unique_ptr<ServedClient>> clients_;  // in the order in which they came
  std::uint64_t bytes_ = 0;                             // of those that are gone
  std::thread thread_;
};

}  // namespace polyhull::element
