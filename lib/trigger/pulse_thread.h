// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The thread that gives pulses at absolute times.
///
/// Pulse times form a grid on a clock of the caller's: t0 + n * period, computed exactly from the
/// rate's fraction, so that errors do not add up. The thread sleeps until the time on
/// CLOCK_MONOTONIC that the caller's clock shows to be the next one; the relation of the clocks
/// is measured anew for each pulse, so that a network or PTP clock is followed.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "trigger/pulse.h"
#include "trigger/serial_line.h"

namespace polyhull {

/// What pulses are given, and on what.
struct PulseParameters {
  std::string device;         ///< path
  std::uint32_t baud = 9600;  ///< bits per second
  PulseMode mode = PulseMode::zeros;
  int rate_numerator = 15;  ///< pulses per second; 0: only on demand
  int rate_denominator = 1;
  std::int64_t pulse = 2000000;  ///< its length, ns
  /// Each demand is followed by a pulse, at the rate at most (0: as soon as the pulse before
  /// allows); the first comes by itself, and others where nobody asks for `timeout`.
  bool follow = false;
  std::int64_t timeout = 1000000000;  ///< ns

  /// Time between pulses, ns; 0 on demand.
  std::int64_t period() const;
  /// How long a pulse really takes, ns: whole bytes for PulseMode::zeros.
  std::int64_t pulse_taken() const;
  /// Throws Error for a pulse below a millisecond, and for one that does not fit into the period
  /// with a millisecond to spare.
  void check() const;
};

/// What the thread reports; called on the thread. None may be empty.
struct PulseListener {
  std::function<void(const Pulse&)> begins;  ///< just before it is given: be quick
  std::function<void()> withdrawn;           ///< that pulse was not given, its number not used
  std::function<void(const Pulse&)> pulsed;  ///< it was given
  /// With `follow`: nobody asked for a pulse within the timeout.
  std::function<void()> timed_out;
  /// Grid times that passed while it was held up.
  std::function<void(std::uint64_t count)> skipped;
  std::function<void()> blocked;                     ///< the device takes no bytes
  std::function<void(const std::string& why)> lost;  ///< the device went away; it is tried again
  std::function<void()> returned;                    ///< and came back
};

class PulseThread {
 public:
  /// Starts. \p line is open; \p clock tells the time, ns; \p first_number is the first pulse's.
  PulseThread(std::unique_ptr<SerialLine> line, const PulseParameters& parameters,
              std::function<std::int64_t()> clock, std::uint64_t first_number,
              PulseListener listener);
  /// Ends the pulse and the thread.
  ~PulseThread();

  /// Other rate, pulse length or timeout from the next pulse on (checked; all else the same).
  void set(const PulseParameters& parameters);

  /// One pulse as soon as may be, but a millisecond after the end of the one before, whatever the
  /// rate. With `follow`, demands that wait are one.
  void fire();

  /// Whether the system granted real-time scheduling.
  bool real_time() const { return real_time_; }

  /// Stops, and gives back the line (null while the device is lost) and the next number.
  std::unique_ptr<SerialLine> stop(std::uint64_t& next_number);

 private:
  void run();
  bool follow_turn(std::unique_lock<std::mutex>& lock, const PulseParameters& parameters,
                   std::int64_t& planned);
  bool wait_for_turn(PulseParameters& parameters, std::int64_t& planned);
  void give_pulse(const PulseParameters& parameters, std::int64_t planned);
  void find_device(const PulseParameters& parameters);

  std::unique_ptr<SerialLine> line_;
  std::function<std::int64_t()> clock_;
  std::uint64_t number_;
  PulseListener listener_;
  bool real_time_ = false;

  std::mutex mutex_;  // protects the following
  std::condition_variable changed_;
  PulseParameters parameters_;
  bool new_grid_ = true;
  bool stopping_ = false;
  int demands_ = 0;
  std::int64_t demanded_ = 0;  // clock time of the oldest demand

  std::int64_t origin_ = 0;  // of the grid; this and the following are the thread's own
  std::int64_t slot_ = 0;
  std::int64_t began_ = INT64_MIN;  // the latest pulse, on CLOCK_MONOTONIC
  std::int64_t free_ = 0;           // when the line is free for the next, there
  std::thread thread_;
};

}  // namespace polyhull
