// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// One client of viewserversink: a thread that proves who it is and then writes to it what is queued, so
/// that nobody else waits for it.
#pragma once

#include <gst/gst.h>

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "plugins/common/memory/mapped_memory.h"
#include "plugins/common/network/tls.h"

namespace polyhull::element {

/// Why a client is served no longer.
enum class ClientEnd {
  none,       ///< it still is
  closed,     ///< by the client or the network, or because the server ends
  refused,    ///< it could not prove who it is
  uninvited,  ///< it has, and is none of those that may come
  late,       ///< it took too long to
  full,       ///< others are served already, as many as may be
  noisy,      ///< it says more than it may
  slow,       ///< it takes nothing any more, or less than there is
};

class ServedClient {
 public:
  static constexpr std::size_t longest_line = 4096;  ///< of what a client says
  /// ... in a second: a slider that is drawn says sixty.
  static constexpr int most_lines = 200;

  /// Told each line that the client says once it has proved who it is, on a thread of the client's.
  using Listener = std::function<void(const std::string& line)>;

  /// Asked once it has proved who it is, on a thread of the client's: where it may be served, trust()
  /// is called and the answer is yes.
  using Admission = std::function<bool(ServedClient&)>;

  /// Who it is: what it is called, and of whom its address is (network_of()).
  struct From {
    std::string address, network;
  };

  /// Serves \p connection, by TLS where \p identity has it, in a thread of its own; first of all it
  /// gets \p head. \p timeout (s) is how long it may take nothing; \p listener hears it, none: nobody
  /// does.
  ServedClient(Ref<GSocketConnection> connection, From from, const TlsIdentity& identity,
               guint timeout, Admission admission, Listener listener,
               const std::vector<Ref<GstBuffer>>& head);
  /// Cuts the connection.
  ~ServedClient();
  ServedClient(const ServedClient&) = delete;

  /// What it gets first instead, where it has not yet proved who it is.
  void begin_with(const std::vector<Ref<GstBuffer>>& head);

  /// Queues \p packet for a client that has proved who it is. Where more than \p most would wait, it
  /// is given up as slow.
  void send(GstBuffer* packet, std::size_t most);

  /// It has proved who it is, and is served from now on.
  void trust();

  /// Ends it where it has gone and nobody has heard of it yet, as nothing is sent.
  void look();

  /// Gives it up, for the reason \p why.
  void end(ClientEnd why);

  ClientEnd ended() const;
  /// What GIO says of the end; may be empty.
  std::string reason() const;
  /// Whether it has proved who it is.
  bool trusted() const;
  /// When it came, monotonic µs.
  std::int64_t since() const { return since_; }
  const std::string& address() const { return from_.address; }
  const std::string& network() const { return from_.network; }
  /// Whether it has all that was queued for it, or gets nothing any more.
  bool has_all() const;
  /// Bytes that it has taken.
  std::uint64_t bytes() const;

 private:
  void serve(const TlsIdentity& identity);
  void serve_all(const TlsIdentity& identity, Ref<GIOStream>& secured);
  void write_all(GOutputStream* output);
  bool write(GOutputStream* output, GstBuffer* packet);
  void end(ClientEnd why, std::string reason);
  void end_locked(ClientEnd why, std::string reason);
  void listen(GInputStream* input);

  const From from_;
  const Admission admission_;
  const Listener listener_;
  const std::int64_t since_ = g_get_monotonic_time();
  Ref<GSocketConnection> connection_;
  Ref<GCancellable> cancel_{g_cancellable_new()};
  mutable std::mutex mutex_;  // protects the six below
  std::condition_variable changed_;
  std::deque<Ref<GstBuffer>> queue_;
  ClientEnd ended_ = ClientEnd::none;
  std::string reason_;
  bool trusted_ = false, writing_ = false;
  std::uint64_t bytes_ = 0;
  std::thread thread_;  // the last: it uses what is above
};

}  // namespace polyhull::element
