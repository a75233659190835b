// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// viewclientsrc: the views or meshes of another machine, over TCP, from a pipeline that ends in
/// gdppay and viewserversink or tcpserversink. It connects again after every cut, trusts nothing
/// that comes before it has been read from end to end, and drops what a cut has made old. Each loss
/// and return of the connection is announced by an element message "polyhull-link" with the fields
/// host, port, connected and reason.
#include <gst/base/gstpushsrc.h>

#include <memory>

#include "base/error.h"
#include "plugins/common/element.h"
#include "plugins/common/guard.h"
#include "plugins/common/memory/mapped_memory.h"
#include "plugins/common/memory/payload_buffer.h"
#include "plugins/viewclientsrc/link.h"
#include "plugins/viewclientsrc/packets.h"
#include "plugins/viewclientsrc/settings.h"

GST_DEBUG_CATEGORY_STATIC(viewclientsrc_debug);
#define GST_CAT_DEFAULT viewclientsrc_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

constexpr std::int64_t other_clock = 60 * GST_SECOND;  // frames older than this are of another one

/// Why a connection is given up: a counter and a sentence. Without a counter: because it shall end.
struct Cut {
  const char* counter;
  std::string why;
  bool waited = false;  // long enough: the next attempt follows at once
};

struct EndOfStream {};

struct CapsUnref {
  void operator()(GstCaps* caps) const { gst_caps_unref(caps); }
};
using CapsRef = std::unique_ptr<GstCaps, CapsUnref>;

struct ViewClientSrc {
  static constexpr char type_name[] = "PolyhullViewClientSrc";
  static GType base_type() { return GST_TYPE_PUSH_SRC; }
  static void class_init(gpointer klass);

  explicit ViewClientSrc(gpointer object) : cancel(g_cancellable_new()) {
    statistics.declare({"connections", "connections-failed", "cuts", "silences", "packets", "bytes",
                        "frames", "frames-stale", "frames-of-another-clock", "refused-packets",
                        "refused-sizes", "refused-rates", "refused-formats", "refused-frames",
                        "refused-keys", "ends-of-sender"});
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
  void tell(const ViewClientSettings& settings);
  void hear(GstElement* element, const PacketHeader& header, std::string_view text);
  GstBuffer* frame(GstElement* element, const PacketHeader& header,
                   const ViewClientSettings& settings);
  bool old(GstElement* element, std::int64_t capture_time, GstClockTime running_time,
           const ViewClientSettings& settings);

  ViewClientSettings settings;  // under the object lock
  Statistics statistics{"viewclientsrc-stats"};
  GRef<GCancellable> cancel;  // cancelled: whoever waits shall return
  // The streaming thread's:
  TlsIdentity identity;
  std::unique_ptr<Link> link;
  RateLimit limit;
  CapsRef format;          // what the connection brings
  CapsRef agreed;          // what the source pad has agreed on
  GstSegment segment;      // the sender's
  std::int64_t waits = 0;  // since when, monotonic µs, for the frame to come
  bool first = true;       // no frame has come over this connection yet
  std::string told,
      unsent;         // settings that this connection knows of, and what of them is to be sent
  bool lost = false;  // it has been said that there is no connection
};

void announce(GstElement* element, const ViewClientSettings& settings, bool connected,
              const char* reason) {
  gst_element_post_message(
      element,
      gst_message_new_element(
          GST_OBJECT(element),
          gst_structure_new("polyhull-link", "host", G_TYPE_STRING, settings.host.c_str(), "port",
                            G_TYPE_UINT, settings.port, "connected", G_TYPE_BOOLEAN, connected,
                            "reason", G_TYPE_STRING, reason, nullptr)));
}

std::string name_of(const ViewClientSettings& settings) {
  return fmt::format("{}:{}", settings.host, settings.port);
}

Cut not_trusted(const std::string& why) {
  return {
      "refused-keys",
      fmt::format("the two ends do not trust each other ({}). Look at the certificate that each "
                  "shows, the authority that each trusts, and the name that the sender's is "
                  "for (tls-name).",
                  why)};
}

/// One attempt; false where it failed, which is said once until there is a connection again.
bool ViewClientSrc::connect(GstElement* element, const ViewClientSettings& now) {
  try {
    link = std::make_unique<Link>(now.host, static_cast<int>(now.port), identity,
                                  now.tls_name.empty() ? now.host : now.tls_name,
                                  static_cast<std::int64_t>(now.timeout), cancel.get());
  } catch (const NotTrusted& error) {
    cut(element, now, not_trusted(error.what()));
    return false;
  } catch (const Error& error) {
    if (g_cancellable_is_cancelled(cancel.get())) return false;
    if (lost) {
      statistics.count("connections-failed");
      GST_INFO_OBJECT(element, "%s", error.what());
    } else {
      lost = true;
      statistics.warn(element, "connections-failed",
                      fmt::format("{}. It is tried until there is an answer.", error.what()));
      announce(element, now, false, error.what());
    }
    return false;
  }
  statistics.count("connections");
  limit = RateLimit();
  waits = g_get_monotonic_time();
  told.clear();
  unsent.clear();
  format.reset();
  gst_segment_init(&segment, GST_FORMAT_TIME);
  first = true;
  return true;
}

void ViewClientSrc::cut(GstElement* element, const ViewClientSettings& now, const Cut& reason) {
  link.reset();
  if (reason.counter == nullptr) return;
  statistics.count("cuts");
  const std::string why = fmt::format("The connection to {} is cut: {}", name_of(now), reason.why);
  statistics.warn(element, reason.counter, why);
  if (!lost) announce(element, now, false, why.c_str());
  lost = true;
}

void ViewClientSrc::read(std::span<std::uint8_t> bytes, const ViewClientSettings& now) {
  const auto left =
      static_cast<std::int64_t>(now.timeout) - 1000 * (g_get_monotonic_time() - waits);
  switch (link->read(bytes, left)) {
    case LinkResult::done:
      return;
    case LinkResult::cancelled:
      throw Cut{nullptr, {}};
    case LinkResult::ended:
      // gdppay sends no end of stream: its sink closes the connection.
      if (now.end_with_sender) {
        statistics.count("ends-of-sender");
        throw EndOfStream{};
      }
      throw Cut{"ends-of-sender", "the sender, or the network, has ended it."};
    case LinkResult::refused:
      throw not_trusted(link->why());
    case LinkResult::silent:
      throw Cut{"silences",
                fmt::format("no whole frame came for {} ms. Look at the sender and the "
                            "link, or set timeout higher.",
                            now.timeout / GST_MSECOND),
                true};
  }
}

/// The next packet's header, if what it announces is within the limits.
PacketHeader ViewClientSrc::read_header(const ViewClientSettings& now) {
  std::uint8_t bytes[packet_header_size];
  read(bytes, now);
  PacketHeader header;
  try {
    header = read_packet_header(bytes);
  } catch (const Error& error) {
    throw Cut{"refused-packets", error.what()};
  }
  const std::uint64_t most =
      header.kind == PacketKind::buffer ? now.max_packet : std::uint64_t{longest_text};
  if (header.size > most)
    throw Cut{"refused-sizes",
              fmt::format("a packet announces {} bytes, and {} are allowed{}.", header.size, most,
                          header.kind == PacketKind::buffer ? " by max-packet" : " for its kind")};
  if (!limit.allows(packet_header_size + header.size, now.max_rate, g_get_monotonic_time()))
    throw Cut{"refused-rates",
              fmt::format("it brings more than {} packets a second, or than max-rate allows.",
                          RateLimit::packets_per_second)};
  return header;
}

/// Tells the sender what has changed in the settings for it.
void ViewClientSrc::tell(const ViewClientSettings& now) {
  if (now.settings != told && unsent.empty()) {
    told = now.settings;
    for (const char c : told) unsent += c == '\n' ? ' ' : c;
    unsent += '\n';
  }
  if (!unsent.empty()) link->send(unsent);
}

/// A caps or event packet.
void ViewClientSrc::hear(GstElement* element, const PacketHeader& header, std::string_view text) {
  if (header.kind == PacketKind::caps) {
    format.reset(read_caps(text));
    if (format == nullptr)
      throw Cut{
          "refused-formats",
          "what it brings is neither views nor meshes, with at most a framerate. The sender's "
          "pipeline must have silhouette, contourfind or hullbuild before gdppay."};
  } else if (header.event == GST_EVENT_SEGMENT) {
    if (!read_segment(text, segment))
      throw Cut{"refused-packets", "its segment is none of times that go forward."};
  } else {
    GST_LOG_OBJECT(element, "an event of type %u has no meaning here", header.event);
  }
}

/// Whether a frame is to be dropped for its age.
bool ViewClientSrc::old(GstElement* element, std::int64_t capture_time, GstClockTime running_time,
                        const ViewClientSettings& now) {
  g_autoptr(GstClock) clock = gst_element_get_clock(element);
  if (now.max_age == 0 || clock == nullptr) return false;
  auto time = static_cast<std::int64_t>(gst_clock_get_time(clock));
  if (capture_time == no_time) {
    if (!GST_CLOCK_TIME_IS_VALID(running_time)) return false;
    capture_time = static_cast<std::int64_t>(running_time);
    time -= static_cast<std::int64_t>(gst_element_get_base_time(element));
  }
  const std::int64_t age = time - capture_time;
  statistics.set("age-ms", 1e-6 * static_cast<double>(age));
  if (age > other_clock || age < -static_cast<std::int64_t>(GST_SECOND)) {
    statistics.warn(element, "frames-of-another-clock",
                    fmt::format("Frames of {} were taken {:.1f} s {} by this pipeline's clock: the "
                                "two machines have different ones. Start both by one clock "
                                "(polyhull-run --clock), or set max-age=0.",
                                name_of(now), 1e-9 * static_cast<double>(std::abs(age)),
                                age > 0 ? "ago" : "from now"));
    return false;
  }
  if (age <= static_cast<std::int64_t>(now.max_age)) return false;
  statistics.warn(
      element, "frames-stale",
      fmt::format("Frames of {} are dropped: they are {:.1f} s old. The link holds them "
                  "up, or the two machines' clocks differ (polyhull-run --clock).",
                  name_of(now), 1e-9 * static_cast<double>(age)));
  return true;
}

/// The frame of a buffer packet; null where it is dropped.
GstBuffer* ViewClientSrc::frame(GstElement* element, const PacketHeader& header,
                                const ViewClientSettings& now) {
  if (format == nullptr)
    throw Cut{"refused-formats", "a frame came before its format. The sender must end in gdppay."};
  MemoryRef memory(gst_allocator_alloc(nullptr, header.size, nullptr));
  std::int64_t capture_time = no_time;
  {
    MappedMemory map(memory == nullptr ? nullptr : gst_memory_ref(memory.get()), GST_MAP_READWRITE);
    read({map.data(), header.size}, now);
    try {
      check_packet_payload(header, map.bytes());
      capture_time = verify_frame(map.bytes(),
                                  gst_structure_get_name(gst_caps_get_structure(format.get(), 0)));
    } catch (const Error& error) {
      statistics.warn(element, "refused-frames",
                      fmt::format("A frame of {} is dropped: {}", name_of(now), error.what()));
      return nullptr;
    }
  }
  const GstClockTime time = header.time == no_time
                                ? GST_CLOCK_TIME_NONE
                                : gst_segment_to_running_time(&segment, GST_FORMAT_TIME,
                                                              static_cast<guint64>(header.time));
  if (old(element, capture_time, time, now)) return nullptr;
  BufferRef buffer(gst_buffer_new());
  gst_buffer_append_memory(buffer.get(), memory.release());
  GST_BUFFER_PTS(buffer.get()) = time;
  if (header.duration != no_time)
    GST_BUFFER_DURATION(buffer.get()) = static_cast<GstClockTime>(header.duration);
  return buffer.release();
}

/// One packet; null where it is no frame, or one that is dropped.
GstBuffer* ViewClientSrc::receive(GstElement* element, const ViewClientSettings& now) {
  const PacketHeader header = read_header(now);
  GstBuffer* received = nullptr;
  if (header.kind == PacketKind::buffer) {
    received = frame(element, header, now);
    waits = g_get_monotonic_time();
  } else {
    char text[longest_text];
    read({reinterpret_cast<std::uint8_t*>(text), header.size}, now);
    std::string_view whole(text, header.size);
    hear(element, header, whole.substr(0, whole.find('\0')));
  }
  statistics.count("packets");
  statistics.count("bytes", packet_header_size + header.size);
  return received;
}

GstFlowReturn create(GstPushSrc* push, GstBuffer** created) {
  auto* element = GST_ELEMENT(push);
  ViewClientSrc& self = state_of<ViewClientSrc>(push);
  return guarded(element, GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    self.waits = g_get_monotonic_time();  // what holds up the stream is not the sender
    while (!g_cancellable_is_cancelled(self.cancel.get())) {
      const ViewClientSettings now = snapshot(push, self.settings);
      if (self.link == nullptr && !self.connect(element, now)) {
        wait_for(self.cancel.get(), static_cast<std::int64_t>(now.retry));
        continue;
      }
      GstBuffer* buffer = nullptr;
      self.tell(now);
      try {
        buffer = self.receive(element, now);
      } catch (const Cut& reason) {
        self.cut(element, now, reason);
        if (!reason.waited) wait_for(self.cancel.get(), static_cast<std::int64_t>(now.retry));
        continue;
      } catch (const EndOfStream&) {
        self.link.reset();
        return GST_FLOW_EOS;
      }
      if (buffer == nullptr) continue;
      if (self.agreed == nullptr || !gst_caps_is_equal(self.agreed.get(), self.format.get())) {
        if (!gst_base_src_set_caps(GST_BASE_SRC(push), self.format.get())) {
          gst_buffer_unref(buffer);
          return GST_FLOW_NOT_NEGOTIATED;
        }
        self.agreed.reset(gst_caps_ref(self.format.get()));
      }
      if (self.first) GST_BUFFER_FLAG_SET(buffer, GST_BUFFER_FLAG_DISCONT);
      if (self.lost) announce(element, now, true, "frames come again");
      self.first = self.lost = false;
      self.statistics.count("frames");
      *created = buffer;
      return GST_FLOW_OK;
    }
    // What comes until there is a return is old by then.
    self.link.reset();
    return GST_FLOW_FLUSHING;
  });
}

gboolean unlock(GstBaseSrc* source) {
  g_cancellable_cancel(state_of<ViewClientSrc>(source).cancel.get());
  return TRUE;
}

gboolean unlock_stop(GstBaseSrc* source) {
  g_cancellable_reset(state_of<ViewClientSrc>(source).cancel.get());
  return TRUE;
}

/// The format is the sender's: there is none before it has said so.
gboolean negotiate(GstBaseSrc*) {
  return TRUE;
}

gboolean answer(GstBaseSrc* source, GstQuery* query) {
  if (GST_QUERY_TYPE(query) != GST_QUERY_LATENCY)
    return GST_BASE_SRC_CLASS(parent_class<ViewClientSrc>())->query(source, query);
  const ViewClientSettings now = snapshot(source, state_of<ViewClientSrc>(source).settings);
  gst_query_set_latency(query, TRUE, now.latency, GST_CLOCK_TIME_NONE);
  return TRUE;
}

GstStateChangeReturn change_state(GstElement* element, GstStateChange transition) {
  ViewClientSrc& self = state_of<ViewClientSrc>(element);
  if (transition == GST_STATE_CHANGE_READY_TO_PAUSED && !guarded(element, false, [&] {
        const ViewClientSettings now = snapshot(element, self.settings);
        if (now.host.empty())
          throw Error(Error::Kind::bad_input,
                      "host is empty; set it to the name or address of the machine that sends.");
        self.identity = TlsIdentity(now.tls_certificate, now.tls_authority);
        self.statistics.reset();
        self.agreed.reset();
        self.lost = false;
        return true;
      }))
    return GST_STATE_CHANGE_FAILURE;
  const GstStateChangeReturn result =
      GST_ELEMENT_CLASS(parent_class<ViewClientSrc>())->change_state(element, transition);
  if (transition == GST_STATE_CHANGE_PAUSED_TO_READY) self.link.reset();
  return result;
}

void ViewClientSrc::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(viewclientsrc_debug, "viewclientsrc", 0, "views from other machines");
  add_properties<ViewClientSrc>(klass, view_client_properties(), &ViewClientSrc::settings);
  add_statistics<ViewClientSrc>(
      klass,
      "Counters since the start: connections, connections-failed (attempts), cuts, silences (cuts "
      "for want of frames), ends-of-sender, packets and bytes (whole packets), frames (sent on), "
      "frames-stale (dropped), frames-of-another-clock (passed), refused-packets (no packet of the "
      "protocol), refused-sizes, refused-rates, refused-formats, refused-keys (of TLS), "
      "refused-frames (dropped, the connection stays); and age-ms, how long ago the last frame was "
      "taken.");
  set_metadata(klass, "View client source", "Source/Network",
               "Receives views or meshes of another machine, connecting again after every cut");
  add_template(klass, "src", GST_PAD_SRC,
               "application/x-polyhull-view; application/x-polyhull-mesh");
  GST_ELEMENT_CLASS(klass)->change_state = change_state;
  GstBaseSrcClass* source = GST_BASE_SRC_CLASS(klass);
  source->unlock = unlock;
  source->unlock_stop = unlock_stop;
  source->negotiate = negotiate;
  source->query = answer;
  GST_PUSH_SRC_CLASS(klass)->create = create;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(viewclientsrc, "viewclientsrc", GST_RANK_NONE, type_of<ViewClientSrc>())
