// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Why a tracking packet was refused, for those who count it.
#pragma once

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

}  // namespace polyhull
