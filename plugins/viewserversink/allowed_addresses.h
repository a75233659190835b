// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The addresses from which clients may come.
#pragma once

#include <gio/gio.h>

#include <string>
#include <vector>

#include "plugins/common/network/tls.h"

namespace polyhull::element {

class AllowedAddresses {
 public:
  /// Reads addresses and networks, "10.0.0.5, 10.1.0.0/16 fd00::/8"; empty: all may come. Throws
  /// Error (bad_input) that names what cannot be read.
  explicit AllowedAddresses(const std::string& text = {});

  /// An IPv4 address that comes in an IPv6 one is taken as what it is.
  bool has(GInetAddress* address) const;

 private:
  std::vector<Ref<GInetAddressMask>> masks_;
};

/// Of whom \p address is: an IPv4 address for itself, an IPv6 one for the 64 bits of its network, of
/// which one machine may have all.
std::string network_of(GInetAddress* address);

}  // namespace polyhull::element
