// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A TCP connection that is read without ever waiting longer than was said, and can be left at any
/// time from another thread.
#pragma once

#include <gio/gio.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace polyhull::element {

struct GUnref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
template <class T>
using GRef = std::unique_ptr<T, GUnref>;

/// What became of a wait.
enum class LinkResult { done, cancelled, ended, silent };

class Link {
 public:
  /// Connects to \p host (a name or an address) and \p port, within 0.4 s for each of its addresses:
  /// a new attempt reaches a machine that is back sooner than the repeats of the old one do.
  /// Throws Error where nobody answers or \p cancel was cancelled.
  Link(const std::string& host, int port, GCancellable* cancel);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// Fills \p bytes. silent: they were not all there within \p timeout ns; ended: the connection is
  /// at its end.
  LinkResult read(std::span<std::uint8_t> bytes, std::int64_t timeout);

 private:
  GCancellable* cancel_;
  GRef<GSocket> socket_;
};

/// Waits for \p time ns or until \p cancel is cancelled.
void wait_for(GCancellable* cancel, std::int64_t time);

}  // namespace polyhull::element
