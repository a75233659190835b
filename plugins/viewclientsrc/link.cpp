// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/viewclientsrc/link.h"

#include <sys/socket.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

namespace polyhull::element {
namespace {

constexpr std::int64_t connect_within = 400'000;         // µs
constexpr std::int64_t least_handshake = 1'000'000'000;  // ns
/// TLS may have to write before it can read: it is looked at again after so long, µs.
constexpr std::int64_t longest_wait = 50'000;

/// Shuts a socket down, whatever is waited for on it, unless it is gone before \p time ns are over or
/// \p cancel is cancelled.
class Deadline {
 public:
  Deadline(GSocket* socket, std::int64_t time, GCancellable* cancel)
      : socket_(socket), cancel_(cancel) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::nanoseconds(time);
    thread_ = std::thread([this, end] {
      std::unique_lock lock(mutex_);
      if (gone_.wait_until(lock, end, [this] { return is_gone_; })) return;
      passed_ = true;
      shut(socket_);
    });
    // Last: where there is no thread nothing is left behind.
    cancelled_ = g_cancellable_connect(cancel, G_CALLBACK(+[](GCancellable*, gpointer socket) {
                                         shut(static_cast<GSocket*>(socket));
                                       }),
                                       socket, nullptr);
  }
  ~Deadline() { stop(); }
  Deadline(const Deadline&) = delete;

  /// Ends the watch; whether the time was over.
  bool stop() {
    if (!thread_.joinable()) return passed_;
    g_cancellable_disconnect(cancel_, cancelled_);
    {
      const std::scoped_lock lock(mutex_);
      is_gone_ = true;
    }
    gone_.notify_one();
    thread_.join();
    return passed_;
  }

 private:
  /// Behind GIO's back: a socket that g_socket_shutdown has seen has no remote address any more, and
  /// TLS takes one for there as it begins.
  static void shut(GSocket* socket) { shutdown(g_socket_get_fd(socket), SHUT_RDWR); }

  GSocket* socket_;
  GCancellable* cancel_;
  gulong cancelled_ = 0;
  std::mutex mutex_;  // protects the next
  bool is_gone_ = false, passed_ = false;
  std::condition_variable gone_;
  std::thread thread_;
};

/// Whether \p error says that one of the two cannot prove who it is, and not that the connection
/// ended or that what came is no TLS.
bool is_of_trust(const GError* error) {
  return g_error_matches(error, G_TLS_ERROR, G_TLS_ERROR_BAD_CERTIFICATE) ||
         g_error_matches(error, G_TLS_ERROR, G_TLS_ERROR_CERTIFICATE_REQUIRED) ||
         g_error_matches(error, G_TLS_ERROR, G_TLS_ERROR_HANDSHAKE);
}

Error ended_at_once(const std::string& where, const std::string& why) {
  return {Error::Kind::io,
          "{} ended the connection before it said who it is ({}): it serves as many as it may "
          "(max-clients), this machine's address is not in its allow, it is stopping, or it has "
          "no TLS",
          where, why};
}

/// TLS over \p socket, both ends of which have proved who they are.
Ref<GIOStream> secured(GSocket* socket, const TlsIdentity& identity, const std::string& name,
                       const std::string& where, std::int64_t timeout, GCancellable* cancel) {
  const Ref<GSocketConnection> plain(g_socket_connection_factory_create_connection(socket));
  Ref<GIOStream> stream = identity.client(G_IO_STREAM(plain.get()), name);
  GError* error = nullptr;
  timeout = std::max(timeout, least_handshake);
  Deadline deadline(socket, timeout, cancel);
  // The deadline ends it where it is cancelled: by itself GIO's TLS then lets go of what it has not.
  const bool shaken =
      g_tls_connection_handshake(G_TLS_CONNECTION(stream.get()), nullptr, &error) != FALSE;
  if (deadline.stop()) {
    g_clear_error(&error);
    throw Error(Error::Kind::io, "{} has not agreed on TLS within {} ms", where,
                timeout / 1'000'000);
  }
  if (shaken) return stream;
  const bool ended = error->domain == G_TLS_ERROR, untrusted = is_of_trust(error);
  const std::string why = take_message(error);
  if (untrusted) throw NotTrusted(Error::Kind::io, "{}", why);
  if (ended) throw ended_at_once(where, why);
  throw Error(Error::Kind::io, "{} has not agreed on TLS: {}", where, why);
}

/// A socket that is connected to \p address; null and \p error where that failed.
Ref<GSocket> connected(GSocketAddress* address, GCancellable* cancel, GError** error) {
  Ref<GSocket> socket(g_socket_new(g_socket_address_get_family(address), G_SOCKET_TYPE_STREAM,
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
  // The socket keeps the address from now on, even where the server resets the connection: TLS takes
  // one for there as it begins.
  const Ref<GSocketAddress> there(g_socket_get_remote_address(socket.get(), error));
  return there != nullptr ? std::move(socket) : nullptr;
}

}  // namespace

Link::Link(const std::string& host, int port, const TlsIdentity& identity, const std::string& name,
           std::int64_t timeout, GCancellable* cancel)
    : cancel_(cancel) {
  const std::string where = fmt::format("{}:{}", host, port);
  g_autoptr(GSocketConnectable) machine =
      g_network_address_new(host.c_str(), static_cast<guint16>(port));
  g_autoptr(GSocketAddressEnumerator) addresses = g_socket_connectable_enumerate(machine);
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
    const bool reset = identity && g_error_matches(error, G_IO_ERROR, G_IO_ERROR_CONNECTION_CLOSED);
    const std::string reason = take_message(error);
    if (reset) throw ended_at_once(where, reason);
    throw Error(Error::Kind::io, "{} cannot be reached: {}", where, reason);
  }
  g_clear_error(&error);
  if (identity) secured_ = secured(socket_.get(), identity, name, where, timeout, cancel);
}

Link::~Link() {
  // At once and without a word: whoever is cut off may not answer.
  if (socket_ != nullptr) g_socket_close(socket_.get(), nullptr);
}

gssize Link::receive(std::span<std::uint8_t> bytes, GError** error) {
  if (secured_ == nullptr)
    return g_socket_receive(socket_.get(), reinterpret_cast<gchar*>(bytes.data()), bytes.size(),
                            cancel_, error);
  GInputStream* input = g_io_stream_get_input_stream(secured_.get());
  return g_pollable_input_stream_read_nonblocking(G_POLLABLE_INPUT_STREAM(input), bytes.data(),
                                                  bytes.size(), cancel_, error);
}

void Link::send(std::string& text) {
  gssize count = 0;
  if (secured_ == nullptr) {
    count = g_socket_send(socket_.get(), text.data(), text.size(), cancel_, nullptr);
  } else {
    GOutputStream* output = g_io_stream_get_output_stream(secured_.get());
    count = g_pollable_output_stream_write_nonblocking(G_POLLABLE_OUTPUT_STREAM(output),
                                                       text.data(), text.size(), cancel_, nullptr);
  }
  if (count > 0) text.erase(0, static_cast<std::size_t>(count));
}

LinkResult Link::ended(const char* why) {
  why_ = why;
  return secured_ != nullptr && !heard_ ? LinkResult::refused : LinkResult::ended;
}

LinkResult Link::read(std::span<std::uint8_t> bytes, std::int64_t timeout) {
  const std::int64_t end = g_get_monotonic_time() + timeout / 1000;
  while (!bytes.empty()) {
    if (g_cancellable_is_cancelled(cancel_)) return LinkResult::cancelled;
    g_autoptr(GError) error = nullptr;
    const gssize count = receive(bytes, &error);
    if (count > 0) {
      heard_ = true;
      bytes = bytes.subspan(static_cast<std::size_t>(count));
      continue;
    }
    if (count == 0) return ended("without a word");
    if (g_error_matches(error, G_IO_ERROR, G_IO_ERROR_CANCELLED)) return LinkResult::cancelled;
    if (!g_error_matches(error, G_IO_ERROR, G_IO_ERROR_WOULD_BLOCK)) {
      // With TLS 1.3 a client learns only now what the server thinks of its certificate.
      return ended(error->message);
    }
    g_clear_error(&error);
    const std::int64_t left = end - g_get_monotonic_time();
    if (left <= 0) return LinkResult::silent;
    const std::int64_t wait = secured_ == nullptr ? left : std::min(left, longest_wait);
    if (g_socket_condition_timed_wait(socket_.get(), G_IO_IN, wait, cancel_, &error)) continue;
    if (g_error_matches(error, G_IO_ERROR, G_IO_ERROR_CANCELLED)) return LinkResult::cancelled;
    if (!g_error_matches(error, G_IO_ERROR, G_IO_ERROR_TIMED_OUT)) return LinkResult::ended;
    if (wait == left) return LinkResult::silent;
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
