// SPDX-License-Identifier: LGPL-2.1-or-later
// What comes over viewclientsrc's connection: formats, segments, frames.
#include "base/error.h"
#include "plugins/common/memory/mapped_memory.h"
#include "plugins/viewclientsrc/private.h"

namespace polyhull::element {
namespace {

constexpr std::int64_t other_clock = 60 * GST_SECOND;  // frames older than this are of another one

}  // namespace

/// A caps or event packet.
void ViewClientSrc::hear(GstElement* element, const PacketHeader& header, std::string_view text) {
  if (header.kind == PacketKind::caps) {
    format.reset(read_caps(text));
    if (format == nullptr)
      throw Cut{
          "refused-formats",
          "what it brings is neither views nor meshes, with at most a framerate. The sender's "
          "pipeline must have silhouette, contourfind or hullbuild before gdppay."};
    // What follows would end the stream over what it cannot take: the sender's fault, not its own.
    if (!gst_pad_peer_query_accept_caps(GST_BASE_SRC_PAD(element), format.get()))
      throw Cut{
          "refused-formats",
          fmt::format("it brings {}, which is not what the pipeline behind {} takes. Views come of "
                      "silhouette or contourfind before the sender's gdppay, meshes of hullbuild.",
                      gst_structure_get_name(gst_caps_get_structure(format.get(), 0)),
                      GST_OBJECT_NAME(element))};
    GST_DEBUG_OBJECT(element, "the sender brings %" GST_PTR_FORMAT, printed(format.get()));
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
  Ref<GstMemory> memory(gst_allocator_alloc(nullptr, header.size, nullptr));
  std::int64_t capture_time = no_time;
  {
    MappedMemory map(memory == nullptr ? nullptr : gst_memory_ref(memory.get()), GST_MAP_READWRITE);
    read({map.data(), header.size}, now);
    try {
      check_packet_payload(header, map.bytes());
      capture_time = verify_frame(
          map.bytes(), gst_structure_get_name(gst_caps_get_structure(format.get(), 0)), now);
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
  Ref<GstBuffer> buffer(gst_buffer_new());
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

}  // namespace polyhull::element
