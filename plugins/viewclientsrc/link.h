// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A TCP connection that is read without ever waiting longer than was said, and can be left at any
/// time from another thread.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/error.h"
#include "plugins/common/network/tls.h"

namespace polyhull::element {

/// What became of a wait.
enum class LinkResult { done, cancelled, ended, silent, refused };

/// One of the two ends cannot prove to the other who it is.
class NotTrusted : public Error {
 public:
  using Error::Error;
};

class Link {
 public:
  /// Connects to \p host (a name or an address) and \p port, within 0.4 s for each of its addresses:
  /// a new attempt reaches a machine that is back sooner than the repeats of the old one do. Where
  /// \p identity has TLS, both prove then who they are; the other's certificate must be for \p name,
  /// and all of that be done within \p timeout ns, or a second where that is less.
  /// Throws Error where nobody answers, the other end ends the connection before it has said who it
  /// is, the time is over, or \p cancel was cancelled; NotTrusted where the proof fails.
  Link(const std::string& host, int port, const TlsIdentity& identity, const std::string& name,
       std::int64_t timeout, GCancellable* cancel);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// Fills \p bytes. silent: they were not all there within \p timeout ns; ended: the connection is
  /// at its end; refused: the other end does not trust this one, see why(); taken for that is, too,
  /// that it ends a connection with TLS before it has sent anything.
  LinkResult read(std::span<std::uint8_t> bytes, std::int64_t timeout);

  /// Sends as much of \p text as can be sent at once, and takes it from \p text. What cannot be sent
  /// because the connection is at its end stays; read() tells of that.
  void send(std::string& text);

  const std::string& why() const { return why_; }

 private:
  LinkResult ended(const char* why);
  gssize receive(std::span<std::uint8_t> bytes, GError** error);

  GCancellable* cancel_;
  Ref<GSocket> socket_;
  Ref<GIOStream> secured_;  // null: without TLS
  bool heard_ = false;      // anything
  std::string why_;
};

/// Waits for \p time ns or until \p cancel is cancelled.
void wait_for(GCancellable* cancel, std::int64_t time);

}  // namespace polyhull::element
