// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A TCP server in a thread of its own that plays what a test wants a sender to do.
#pragma once

#include <gio/gio.h>
#include <sys/socket.h>

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <thread>
#include <vector>

namespace polyhull::test {

/// One accepted connection, as the server sees it.
class Accepted {
 public:
  Accepted(GSocketConnection* connection, GCancellable* cancel)
      : connection_(connection), cancel_(cancel) {}

  /// Sends \p bytes; false where the other end takes no more.
  bool send(std::span<const std::uint8_t> bytes) {
    GOutputStream* output = g_io_stream_get_output_stream(G_IO_STREAM(connection_));
    return g_output_stream_write_all(output, bytes.data(), bytes.size(), nullptr, cancel_,
                                     nullptr) != FALSE;
  }

  /// Closed, the connection is reset.
  void reset_at_close() {
    const linger at_once{1, 0};
    setsockopt(g_socket_get_fd(g_socket_connection_get_socket(connection_)), SOL_SOCKET, SO_LINGER,
               &at_once, sizeof at_once);
  }

  /// Waits until the other end has cut the connection, or the test ends.
  void wait_for_cut() {
    GInputStream* input = g_io_stream_get_input_stream(G_IO_STREAM(connection_));
    std::uint8_t byte;
    while (g_input_stream_read(input, &byte, 1, cancel_, nullptr) > 0) {
    }
  }

 private:
  GSocketConnection* connection_;
  GCancellable* cancel_;
};

/// Plays \p script for each connection, one after the other, with their number from 0; each is
/// closed where the script ends.
class Sender {
 public:
  using Script = std::function<void(int number, Accepted&)>;

  explicit Sender(Script script) : script_(std::move(script)) {
    GError* error = nullptr;
    GSocketAddress* address = g_inet_socket_address_new_from_string("127.0.0.1", 0);
    GSocketAddress* bound = nullptr;
    if (!g_socket_listener_add_address(listener_, address, G_SOCKET_TYPE_STREAM,
                                       G_SOCKET_PROTOCOL_TCP, nullptr, &bound, &error))
      g_error("%s", error->message);
    port_ = g_inet_socket_address_get_port(G_INET_SOCKET_ADDRESS(bound));
    g_object_unref(bound);
    g_object_unref(address);
    thread_ = std::thread([this] { serve(); });
  }
  ~Sender() {
    g_cancellable_cancel(cancel_);
    thread_.join();
    g_object_unref(listener_);
    g_object_unref(cancel_);
  }
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;

  int port() const { return port_; }

 private:
  void serve() {
    for (int number = 0;; ++number) {
      GSocketConnection* connection =
          g_socket_listener_accept(listener_, nullptr, cancel_, nullptr);
      if (connection == nullptr) return;
      Accepted accepted(connection, cancel_);
      script_(number, accepted);
      g_io_stream_close(G_IO_STREAM(connection), nullptr, nullptr);
      g_object_unref(connection);
    }
  }

  Script script_;
  GSocketListener* listener_ = g_socket_listener_new();
  GCancellable* cancel_ = g_cancellable_new();
  int port_ = 0;
  std::thread thread_;
};

}  // namespace polyhull::test
