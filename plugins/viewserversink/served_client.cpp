// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/viewserversink/served_client.h"

#include <linux/sockios.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/ioctl.h>

#include <utility>

#include "base/error.h"
#include "plugins/common/memory/payload_buffer.h"

namespace polyhull::element {

ServedClient::ServedClient(Ref<GSocketConnection> connection, From from,
                           const TlsIdentity& identity, guint timeout, Admission admission,
                           Listener listener, const std::vector<Ref<GstBuffer>>& head)
    : from_(std::move(from)),
      admission_(std::move(admission)),
      listener_(std::move(listener)),
      connection_(std::move(connection)) {
  GSocket* socket = g_socket_connection_get_socket(connection_.get());
  g_socket_set_timeout(socket, timeout);
  // Whoever is gone without a word is known to be so soon, and keeps nobody's place: asked after
  // `timeout` without a byte, and given up where no answer comes for as long.
  const auto seconds = static_cast<gint>(timeout);
  g_socket_set_keepalive(socket, TRUE);
  g_socket_set_option(socket, IPPROTO_TCP, TCP_KEEPIDLE, seconds, nullptr);
  g_socket_set_option(socket, IPPROTO_TCP, TCP_KEEPINTVL, 1, nullptr);
  g_socket_set_option(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, 1000 * seconds, nullptr);
  // A frame's last bytes wait for no answer to those before.
  g_socket_set_option(socket, IPPROTO_TCP, TCP_NODELAY, 1, nullptr);
  // Without TLS whoever has come is trusted as soon as the thread runs.
  begin_with(head);
  thread_ = std::thread([this, &identity] { serve(identity); });
}

ServedClient::~ServedClient() {
  end(ClientEnd::closed);
  thread_.join();
  // At once and without a word: whoever is cut off may not answer.
  g_socket_close(g_socket_connection_get_socket(connection_.get()), nullptr);
}

void ServedClient::trust() {
  const std::scoped_lock lock(mutex_);
  trusted_ = true;
}

void ServedClient::look() {
  if (listener_) return;  // it is read, and what it says last is not to be lost
  const std::scoped_lock lock(mutex_);
  if (!trusted_ || ended_ != ClientEnd::none) return;
  pollfd socket{g_socket_get_fd(g_socket_connection_get_socket(connection_.get())), POLLRDHUP, 0};
  if (poll(&socket, 1, 0) > 0) end_locked(ClientEnd::closed, {});
}

void ServedClient::end(ClientEnd why) {
  end(why, {});
}

void ServedClient::end(ClientEnd why, std::string reason) {
  const std::scoped_lock lock(mutex_);
  end_locked(why, std::move(reason));
}

void ServedClient::end_locked(ClientEnd why, std::string reason) {
  if (ended_ != ClientEnd::none) return;
  ended_ = why;
  reason_ = std::move(reason);
  queue_.clear();
  // What waits on the socket ends at once, TLS's goodbye included: it would wait for the client.
  // Under the lock: nobody who sees the end has closed it by then.
  g_socket_shutdown(g_socket_connection_get_socket(connection_.get()), TRUE, TRUE, nullptr);
  g_cancellable_cancel(cancel_.get());
  changed_.notify_all();
}

void ServedClient::begin_with(const std::vector<Ref<GstBuffer>>& head) {
  const std::scoped_lock lock(mutex_);
  if (trusted_ || ended_ != ClientEnd::none) return;
  queue_.clear();
  for (const Ref<GstBuffer>& packet : head) queue_.emplace_back(gst_buffer_ref(packet.get()));
}

void ServedClient::send(GstBuffer* packet, std::size_t most) {
  const std::scoped_lock lock(mutex_);
  if (ended_ != ClientEnd::none || !trusted_) return;
  if (queue_.size() >= most) return end_locked(ClientEnd::slow, {});
  queue_.emplace_back(gst_buffer_ref(packet));
  changed_.notify_all();
}

ClientEnd ServedClient::ended() const {
  const std::scoped_lock lock(mutex_);
  return ended_;
}

std::string ServedClient::reason() const {
  const std::scoped_lock lock(mutex_);
  return reason_;
}

bool ServedClient::trusted() const {
  const std::scoped_lock lock(mutex_);
  return trusted_;
}

bool ServedClient::has_all() const {
  const std::scoped_lock lock(mutex_);
  if (!trusted_ || ended_ != ClientEnd::none) return true;
  int underway = 0;  // not acknowledged
  ioctl(g_socket_get_fd(g_socket_connection_get_socket(connection_.get())), SIOCOUTQ, &underway);
  return queue_.empty() && !writing_ && underway == 0;
}

std::uint64_t ServedClient::bytes() const {
  const std::scoped_lock lock(mutex_);
  return bytes_;
}

/// False where it was not taken whole.
bool ServedClient::write(GOutputStream* output, GstBuffer* packet) {
  const MappedBuffer mapped(packet);
  for (const Bytes& part : mapped.segments()) {
    GError* error = nullptr;
    if (!g_output_stream_write_all(output, part.data(), part.size(), nullptr, cancel_.get(),
                                   &error)) {
      const bool slow = g_error_matches(error, G_IO_ERROR, G_IO_ERROR_TIMED_OUT);
      end(slow ? ClientEnd::slow : ClientEnd::closed, take_message(error));
      return false;
    }
    const std::scoped_lock lock(mutex_);
    bytes_ += part.size();
  }
  return true;
}

void ServedClient::serve(const TlsIdentity& identity) {
  // Lasts beyond end(): before, its closing would wait for a client that takes nothing.
  Ref<GIOStream> secured;
  try {
    serve_all(identity, secured);
  } catch (const std::exception& why) {
    end(ClientEnd::closed, why.what());
  }
}

void ServedClient::serve_all(const TlsIdentity& identity, Ref<GIOStream>& secured) {
  if (identity) {
    GError* error = nullptr;
    secured = identity.server(G_IO_STREAM(connection_.get()));
    // end() shuts its socket down: not every version of GIO's TLS can be cancelled here.
    if (!g_tls_connection_handshake(G_TLS_CONNECTION(secured.get()), nullptr, &error)) {
      const bool late = g_error_matches(error, G_IO_ERROR, G_IO_ERROR_TIMED_OUT);
      const bool other = TlsIdentity::has_other_name(secured.get());
      end(late    ? ClientEnd::late
          : other ? ClientEnd::uninvited
                  : ClientEnd::refused,
          take_message(error));
      return;
    }
  }
  if (!admission_(*this)) return end(ClientEnd::full);
  GOutputStream* output = g_io_stream_get_output_stream(
      secured != nullptr ? secured.get() : G_IO_STREAM(connection_.get()));
  // Ends with this, however this ends.
  struct Ear {
    GCancellable* cancel;
    std::thread thread;
    ~Ear() {
      if (!thread.joinable()) return;
      g_cancellable_cancel(cancel);
      thread.join();
    }
  } ear{cancel_.get(), {}};
  if (listener_) {
    GIOStream* stream = secured != nullptr ? secured.get() : G_IO_STREAM(connection_.get());
    ear.thread =
        std::thread([this, input = g_io_stream_get_input_stream(stream)] { listen(input); });
  }
  write_all(output);
}

/// What the client says, line by line, until the connection ends.
void ServedClient::listen(GInputStream* input) {
  std::string line;
  char bytes[512];
  std::int64_t second = 0;
  int lines = 0;
  while (!g_cancellable_is_cancelled(cancel_.get())) {
    GError* error = nullptr;
    const gssize count = g_input_stream_read(input, bytes, sizeof bytes, cancel_.get(), &error);
    if (count < 0 && g_error_matches(error, G_IO_ERROR, G_IO_ERROR_TIMED_OUT)) {
      g_clear_error(&error);  // it has nothing to say
      continue;
    }
    if (count <= 0) {
      end(ClientEnd::closed, error != nullptr ? take_message(error) : "");
      return;
    }
    for (gssize i = 0; i < count; ++i) {
      if (bytes[i] != '\n') {
        line += bytes[i];
        continue;
      }
      const std::int64_t now = g_get_monotonic_time() / 1'000'000;
      if (now != second) lines = 0;
      second = now;
      if (++lines > most_lines)
        return end(ClientEnd::noisy,
                   fmt::format("it says more than {} lines a second", most_lines));
      if (!line.empty()) listener_(line);
      line.clear();
    }
    if (line.size() > longest_line)
      return end(ClientEnd::noisy,
                 fmt::format("it says a line of more than {} bytes", longest_line));
  }
}

/// What is queued, until the connection ends.
void ServedClient::write_all(GOutputStream* output) {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return !queue_.empty() || ended_ != ClientEnd::none; });
    if (ended_ != ClientEnd::none) return;
    const Ref<GstBuffer> packet = std::move(queue_.front());
    queue_.pop_front();
    writing_ = true;
    lock.unlock();
    if (!write(output, packet.get())) return;
    lock.lock();
    writing_ = false;
  }
}

}  // namespace polyhull::element
