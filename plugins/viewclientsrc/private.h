// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the parts of viewclientsrc share: its state.
#pragma once

#include <gst/base/gstpushsrc.h>

#include <memory>
#include <string>

#include "plugins/common/element.h"
#include "plugins/common/log.h"
#include "plugins/common/memory/payload_buffer.h"
#include "plugins/viewclientsrc/link.h"
#include "plugins/viewclientsrc/packets.h"
#include "plugins/viewclientsrc/settings.h"

GST_DEBUG_CATEGORY_EXTERN(viewclientsrc_debug);
#define GST_CAT_DEFAULT viewclientsrc_debug

namespace polyhull::element {

/// Why a connection is given up: a counter and a sentence. Without a counter: because it shall end.
struct Cut {
  const char* counter;
  std::string why;
  bool waited = false;  // long enough: the next attempt follows at once
};

struct EndOfStream {};

struct ViewClientSrc {
  static constexpr char type_name[] = "PolyhullViewClientSrc";
  static GType base_type() { return GST_TYPE_PUSH_SRC; }
  static void class_init(gpointer klass);

  explicit ViewClientSrc(gpointer object) : cancel(g_cancellable_new()) {
    statistics.declare({"connections", "connections-failed", "cuts", "silences", "packets", "bytes",
                        "frames", "frames-stale", "frames-of-another-clock", "refused-packets",
                        "refused-sizes", "refused-rates", "refused-formats", "refused-frames",
                        "refused-keys", "ends-of-sender", "settings-refused"});
    statistics.set("age-ms", 0.0);
    gst_base_src_set_live(GST_BASE_SRC(object), TRUE);
    gst_base_src_set_format(GST_BASE_SRC(object), GST_FORMAT_TIME);
  }
  void property_set(gpointer object, std::string_view name) {
    if (name == "latency")
      gst_element_post_message(GST_ELEMENT(object), gst_message_new_latency(GST_OBJECT(object)));
  }

  bool connect(GstElement* element, const ViewClientSettings& settings);
  void cut(GstElement* element, const ViewClientSettings& settings, const Cut& reason);
  void read(std::span<std::uint8_t> bytes, const ViewClientSettings& settings);
  PacketHeader read_header(const ViewClientSettings& settings);
  GstBuffer* receive(GstElement* element, const ViewClientSettings& settings);
  void tell(GstElement* element, const ViewClientSettings& settings);
  void hear(GstElement* element, const PacketHeader& header, std::string_view text);
  GstBuffer* frame(GstElement* element, const PacketHeader& header,
                   const ViewClientSettings& settings);
  bool old(GstElement* element, std::int64_t capture_time, GstClockTime running_time,
           const ViewClientSettings& settings);

  ViewClientSettings settings;  // under the object lock
  Statistics statistics{"viewclientsrc-stats"};
  Ref<GCancellable> cancel;  // cancelled: whoever waits shall return
  // The streaming thread's:
  TlsIdentity identity;
  std::unique_ptr<Link> link;
  RateLimit limit;
  Ref<GstCaps> format;     // what the connection brings
  Ref<GstCaps> agreed;     // what the source pad has agreed on
  GstSegment segment;      // the sender's
  std::int64_t waits = 0;  // since when, monotonic µs, for the frame to come
  bool first = true;       // no frame has come over this connection yet
  std::string told,
      unsent;         // settings that this connection knows of, and what of them is to be sent
  bool lost = false;  // it has been said that there is no connection
};

/// The most bytes of the property settings: the sender cuts a line of more than 4096.
inline constexpr std::size_t longest_settings = 4000;

/// What is said of more.
std::string too_long(const std::string& settings);

/// Posts the message polyhull-link.
void announce(GstElement* element, const ViewClientSettings& settings, bool connected,
              const char* reason);

/// HOST:PORT.
std::string name_of(const ViewClientSettings& settings);

}  // namespace polyhull::element
