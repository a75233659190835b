// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Why tracking packets and their samples are refused; numbers in packets.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>

#include "base/error.h"

namespace polyhull {

/// A packet (not its sample) that is not what its protocol promises; always bad_input.
class PacketError : public Error {
 public:
  enum class Fault {
    truncated,  ///< fewer bytes than the protocol or the packet's header says
    checksum,   ///< the sum does not fit the bytes
  };
  template <typename... Values>
  PacketError(Fault fault, fmt::format_string<Values...> format, Values&&... values)
      : Error(Kind::bad_input, format, std::forward<Values>(values)...), fault_(fault) {}
  Fault fault() const { return fault_; }

 private:
  Fault fault_;
};

/// A packet or sample of OpenTrackIO that cannot be used (bad_input).
inline Error opentrackio_error(const std::string& what) {
  return Error(Error::Kind::bad_input, "OpenTrackIO: {}.", what);
}

/// A number of up to four \p bytes, the highest first.
inline std::uint32_t big_endian(std::span<const std::uint8_t> bytes) {
  std::uint32_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8 | byte;
  return value;
}

/// Numbers further back than this are a sender that began anew, not a packet on a detour.
constexpr int furthest_detour = 100;

}  // namespace polyhull
