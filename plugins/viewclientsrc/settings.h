// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The properties of viewclientsrc, and what holds a connection to its limits.
#pragma once

#include <gst/gst.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>

#include "plugins/common/property_table.h"

namespace polyhull::element {

struct ViewClientSettings {
  std::string host = "127.0.0.1";
  std::uint32_t port = 7481;
  std::uint64_t timeout = GST_SECOND;
  std::uint64_t retry = 200 * GST_MSECOND;
  std::uint64_t max_age = GST_SECOND;
  std::uint64_t max_packet = 64 << 20;
  std::uint64_t max_rate = 0;
  std::uint64_t latency = 0;
  bool end_with_sender = false;
  std::string tls_certificate, tls_authority, tls_name;
  std::string settings;
  std::string camera;
  std::uint32_t max_vertices = 10'000;
  std::uint64_t max_unpacked = 64 << 20;
};

std::span<const Property<ViewClientSettings>> view_client_properties();

/// How much one connection may send: bytes and packets per second, with a second's worth at once.
class RateLimit {
 public:
  /// Most packets per second, of which gdppay sends one for each frame and few others.
  static constexpr double packets_per_second = 2000;

  /// Whether a packet of \p bytes may come at \p time (µs); \p max_rate bytes per second, 0: any.
  bool allows(std::uint64_t bytes, std::uint64_t max_rate, std::int64_t time) {
    const double passed = first_ ? 1.0 : 1e-6 * static_cast<double>(time - time_);
    const auto rate = static_cast<double>(max_rate);
    first_ = false;
    time_ = time;
    packets_ = std::min(packets_per_second, packets_ + passed * packets_per_second) - 1.0;
    bytes_ = std::min(rate, bytes_ + passed * rate) - static_cast<double>(bytes);
    return packets_ >= 0.0 && (max_rate == 0 || bytes_ >= 0.0);
  }

 private:
  bool first_ = true;
  std::int64_t time_ = 0;
  double packets_ = 0.0, bytes_ = 0.0;  // what may still come
};

}  // namespace polyhull::element
