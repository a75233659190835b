// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/viewclientsrc/link.h"

#include "base/error.h"

namespace polyhull::element {
namespace {

/// Frees \p error and gives its sentence.
std::string take_message(GError* error) {
  std::string message = error != nullptr ? error->message : "no reason is given";
  g_clear_error(&error);
  return message;
}

constexpr std::int64_t connect_within = 400'000;  // µs

/// A socket that is connected to \p address; null and \p error where that failed.
GRef<GSocket> connected(GSocketAddress* address, GCancellable* cancel, GError** error) {
  GRef<GSocket> socket(g_socket_new(g_socket_address_get_family(address), G_SOCKET_TYPE_STREAM,
                                    G_SOCKET_PROTOCOL_TCP, error));
  if (socket == nullptr) return nullptr;
  g_socket_set_blocking(socket.get(), FALSE);
  g_socket_set_keepalive(socket.get(), TRUE);
  g_autoptr(GError) pending = nullptr;
  if (g_socket_connect(socket.get(), address, cancel, &pending)) return socket;
  if (!g_error_matches(pending, G_IO_ERROR, G_IO_ERROR_PENDING)) {
    g_propagate_error(error, static_cast<GError*>(g_steal_pointer(&pending)));
    return nullptr;
  }
  if (!g_socket_condition_timed_wait(socket.get(), G_IO_OUT, connect_within, cancel, error) ||
      !g_socket_check_connect_result(socket.get(), error))
    return nullptr;
  return socket;
}

}  // namespace

Link::Link(const std::string& host, int port, GCancellable* cancel) : cancel_(cancel) {
  g_autoptr(GSocketConnectable) name =
      g_network_address_new(host.c_str(), static_cast<guint16>(port));
  g_autoptr(GSocketAddressEnumerator) addresses = g_socket_connectable_enumerate(name);
  GError* error = nullptr;
  while (socket_ == nullptr) {
    GError* why = nullptr;
    g_autoptr(GSocketAddress) address = g_socket_address_enumerator_next(addresses, cancel, &why);
    if (address != nullptr) {
      g_clear_error(&error);
      socket_ = connected(address, cancel, &error);
      continue;
    }
    if (why != nullptr) {
      g_clear_error(&error);
      error = why;
    }
    throw Error(Error::Kind::io, "{}:{} cannot be reached: {}", host, port, take_message(error));
  }
  g_clear_error(&error);
}

Link::~Link() {
  // At once and without a word: whoever is cut off may not answer.
  if (socket_ != nullptr) g_socket_close(socket_.get(), nullptr);
}

LinkResult Link::read(std::span<std::uint8_t> bytes, std::int64_t timeout) {
  const std::int64_t end = g_get_monotonic_time() + timeout / 1000;
  while (!bytes.empty()) {
    if (g_cancellable_is_cancelled(cancel_)) return LinkResult::cancelled;
    g_autoptr(GError) error = nullptr;
    const gssize count = g_socket_receive(socket_.get(), reinterpret_cast<gchar*>(bytes.data()),
                                          bytes.size(), cancel_, &error);
    if (count > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(count));
      continue;
    }
    if (count == 0) return LinkResult::ended;
    if (g_error_matches(error, G_IO_ERROR, G_IO_ERROR_CANCELLED)) return LinkResult::cancelled;
    if (!g_error_matches(error, G_IO_ERROR, G_IO_ERROR_WOULD_BLOCK)) return LinkResult::ended;
    g_clear_error(&error);
    const std::int64_t left = end - g_get_monotonic_time();
    if (left <= 0) return LinkResult::silent;
    if (g_socket_condition_timed_wait(socket_.get(), G_IO_IN, left, cancel_, &error)) continue;
    if (g_error_matches(error, G_IO_ERROR, G_IO_ERROR_CANCELLED)) return LinkResult::cancelled;
    return g_error_matches(error, G_IO_ERROR, G_IO_ERROR_TIMED_OUT) ? LinkResult::silent
                                                                    : LinkResult::ended;
  }
  return LinkResult::done;
}

void wait_for(GCancellable* cancel, std::int64_t time) {
  GPollFD file;
  if (!g_cancellable_make_pollfd(cancel, &file)) {
    g_usleep(static_cast<gulong>(time / 1000));
    return;
  }
  g_poll(&file, 1, static_cast<gint>(time / 1'000'000));
  g_cancellable_release_fd(cancel);
}

}  // namespace polyhull::element
