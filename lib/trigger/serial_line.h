// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A serial device as a source of pulses on one of its lines.
#pragma once

#include <cstdint>
#include <string>

namespace polyhull {

enum class PulseMode {
  zeros,       ///< a packet of zero bytes holds TX
  line_break,  ///< the break condition holds TX for exactly the pulse
  rts,         ///< the RTS line
  dtr,         ///< the DTR line
};

/// An open serial device, 8N1, raw.
class SerialLine {
 public:
  /// \p baud: bits per second. Throws Error: no such device, no permission, in use, not a serial
  /// device, baud rate refused, no such line.
  SerialLine(const std::string& device, std::uint32_t baud, PulseMode mode);
  ~SerialLine();
  SerialLine(const SerialLine&) = delete;
  SerialLine& operator=(const SerialLine&) = delete;

  /// How many zero bytes (at least 1) take at least \p pulse ns, and how long \p bytes take, ns.
  static std::uint32_t bytes_for(std::int64_t pulse, std::uint32_t baud);
  static std::int64_t duration_of(std::uint32_t bytes, std::uint32_t baud);

  enum class Result { done, blocked, lost };

  /// Starts a pulse (zeros: writes the whole packet of \p bytes). blocked: nobody takes the bytes;
  /// lost: the device is gone.
  Result begin_pulse(std::uint32_t bytes);

  /// Ends a pulse; nothing to do for zeros.
  Result end_pulse();

 private:
  Result set_line(bool on);

  int file_ = -1;
  PulseMode mode_;
};

}  // namespace polyhull
