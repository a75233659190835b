// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/viewserversink/settings.h"

namespace polyhull::element {

std::span<const Property<ViewServerSettings>> view_server_properties() {
  using S = ViewServerSettings;
  static const Property<S> table[] = {
      property<&S::host>("host",
                         "Address of this machine at which clients are served; 0.0.0.0: all of "
                         "them, :: those of IPv6, too.",
                         0, 0, Change::when_ready),
      property<&S::port>("port",
                         "The TCP port (0 to 65535); 0: any that is free, stats tell which.", 0,
                         65535, Change::when_ready),
      property<&S::allow>("allow",
                          "Addresses and networks from which clients may come, as in \"10.0.0.5, "
                          "10.1.0.0/16\"; empty: from anywhere.",
                          0, 0, Change::when_ready),
      property<&S::tls_certificate>(
          "tls-certificate",
          "PEM file with this machine's certificate and its private key; empty: no TLS.", 0, 0,
          Change::when_ready),
      property<&S::tls_authority>(
          "tls-authority",
          "PEM file with the certificates of who signs those of the clients that are trusted.", 0,
          0, Change::when_ready),
      property<&S::tls_clients>(
          "tls-clients",
          "Names or addresses of the machines that may be clients, as in \"server recorder\": a "
          "client's certificate must be for one of them. Empty: all that tls-authority signs.",
          0, 0, Change::when_ready),
      property<&S::settings_for>("settings-for",
                                 "Name of the element of this pipeline whose properties clients "
                                 "may set, those that may change while it plays and are no files "
                                 "or other texts but polygons; needs TLS. Empty: none.",
                                 0, 0, Change::when_ready),
      property<&S::max_clients>(
          "max-clients", "How many are served at once (1 to 1000); more are refused.", 1, 1000),
      property<&S::buffers_max>("buffers-max",
                                "A client that so many frames wait for is given up (4 to 10000).",
                                4, 10000),
      property<&S::timeout>(
          "timeout",
          "A client that takes nothing for so many nanoseconds, or has not proved by then who it "
          "is, is given up (1 s to 1000 s; whole seconds, for those that come from then on). At "
          "the end of the stream clients have so long to take the last of it.",
          1.0 * GST_SECOND, 1000.0 * GST_SECOND),
  };
  return table;
}

}  // namespace polyhull::element
