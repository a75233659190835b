// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Whether a clock that a pipeline follows is still there, and still the same.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

/// Watches a network clock or a PTP clock; others are never lost. For one thread.
class ClockWatch {
 public:
  /// \p server is what people call it by.
  ClockWatch(GstClock* clock, std::string server);
  ~ClockWatch();
  ClockWatch(const ClockWatch&) = delete;
  ClockWatch& operator=(const ClockWatch&) = delete;

  /// To be called about once a second. Says on stderr when nothing has come for five seconds, during
  /// which this machine's own clock goes on, and when something comes again. Throws polyhull::Error
  /// where the clock that comes is another one than this pipeline runs by, by a second and more, as
  /// after its machine was started again: a GstClock never goes back, so its times would stand still.
  void look();

  /// How often it has been lost.
  std::uint64_t losses() const { return losses_; }

 private:
  /// The clock's time \p remote at this machine's monotonic \p local, ns.
  struct Observation {
    GstClockTime local = 0, remote = 0;
  };
  std::optional<Observation> latest();
  static gboolean hear_ptp(guint8 domain, const GstStructure* stats, gpointer watch);

  GstClock* clock_;
  std::string server_;
  GstBus* bus_ = nullptr;  // what a network clock tells
  gulong ptp_ = 0;         // who hears what PTP tells
  guint domain_ = 0;       // of PTP
  std::mutex mutex_;       // protects the next, which PTP's thread sets
  std::optional<Observation> heard_;
  std::int64_t heard_at_;  // monotonic µs
  bool lost_ = false, wrong_ = false;
  std::uint64_t losses_ = 0;
};
