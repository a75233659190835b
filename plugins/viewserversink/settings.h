// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The properties of viewserversink.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <span>
#include <string>

#include "plugins/common/property_table.h"

namespace polyhull::element {

struct ViewServerSettings {
  std::string host = "0.0.0.0";
  std::uint32_t port = 7481;
  std::string allow;
  std::string tls_certificate, tls_authority, tls_clients;
  std::string settings_for;
  std::uint32_t max_clients = 8;
  std::uint32_t buffers_max = 50;
  std::uint64_t timeout = 2 * GST_SECOND;
};

std::span<const Property<ViewServerSettings>> view_server_properties();

}  // namespace polyhull::element
