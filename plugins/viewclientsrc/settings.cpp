// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/viewclientsrc/settings.h"

namespace polyhull::element {

std::span<const Property<ViewClientSettings>> view_client_properties() {
  using S = ViewClientSettings;
  static const Property<S> table[] = {
      property<&S::host>(
          "host", "Name or address of the machine that sends: the only one that is listened to.", 0,
          0, Change::when_ready),
      property<&S::port>("port", "Its TCP port (1 to 65535).", 1, 65535, Change::when_ready),
      property<&S::timeout>(
          "timeout",
          "A connection over which no whole frame has come for so many nanoseconds (10 ms to 1000 "
          "s) is cut and made again. It must be longer than from one frame to the next.",
          10.0 * GST_MSECOND, 1000.0 * GST_SECOND),
      property<&S::retry>(
          "retry",
          "How long after a cut or a failed attempt it connects again, in nanoseconds (1 ms to "
          "1000 s). After a silence of timeout it does so at once.",
          GST_MSECOND, 1000.0 * GST_SECOND),
      property<&S::max_age>(
          "max-age",
          "Frames that were taken longer ago than this, by the pipeline's clock, are dropped, in "
          "nanoseconds (0 to 60 s; 0: none): after a cut, what was held up. Frames more than a "
          "minute old, or from the future, are of another clock and pass with a warning.",
          0, 60.0 * GST_SECOND),
      property<&S::max_packet>("max-packet",
                               "The most bytes that one frame may have (1024 to 1 GiB); a "
                               "connection that announces more is cut.",
                               1024, 1 << 30),
      property<&S::max_rate>("max-rate",
                             "The most bytes per second that may come, with a second's worth at "
                             "once; a connection that brings more is cut. 0: any.",
                             0, 1e12),
      property<&S::camera>(
          "camera", "The camera whose views come here: those of others are dropped. Empty: any's."),
      property<&S::max_vertices>(
          "max-vertices",
          "The most vertices that the outlines of one view may have (3 to 10 million); a view with "
          "more, over which the hull would take long, is dropped.",
          3, 10'000'000),
      property<&S::max_unpacked>(
          "max-unpacked",
          "The most bytes that the pixels of one view may be, unpacked (1024 to 256 MiB): a "
          "kilobyte of the wire can become all that. A view with more is dropped.",
          1024, 256 << 20),
      property<&S::latency>(
          "latency",
          "The latency that is reported, in nanoseconds (0 to 10 s). hullbuild learns by itself "
          "how late views come; set it where what follows does not.",
          0, 10.0 * GST_SECOND),
      property<&S::end_with_sender>("end-with-sender",
                                    "The stream ends where the sender closes the connection; "
                                    "otherwise the sender is waited for as after any cut."),
      property<&S::tls_certificate>(
          "tls-certificate",
          "PEM file with this machine's certificate and its private key; empty: no TLS.", 0, 0,
          Change::when_ready),
      property<&S::tls_authority>("tls-authority",
                                  "PEM file with the certificates of who signs the sender's.", 0, 0,
                                  Change::when_ready),
      property<&S::settings>(
          "settings",
          "Properties that the sender's element is to have, as in \"sigma=1.5\": sent with each "
          "connection and where they change, and taken where the sender's viewserversink has "
          "settings-for. At most 4000 bytes; empty: it keeps those that it has."),
      property<&S::tls_name>(
          "tls-name", "The name or address that the sender's certificate must be for; empty: host.",
          0, 0, Change::when_ready),
  };
  return table;
}

}  // namespace polyhull::element
