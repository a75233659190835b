// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/takesrc/take_stream.h"

#include <utility>
#include <vector>

#include "base/error.h"

namespace polyhull::element {

void send_caps(Stream& stream, const std::string& text) {
  if (!text.empty()) {
    GstCaps* caps = gst_caps_from_string(text.c_str());
    if (caps == nullptr)
      throw Error(Error::Kind::bad_input, "The take says of {} what are no caps: '{}'.",
                  GST_PAD_NAME(stream.pad), text);
    gst_pad_push_event(stream.pad, gst_event_new_caps(caps));
    gst_caps_unref(caps);
  }
  stream.caps = text;
}

void send_announcement(Stream& stream, std::int64_t event) {
  stream.event = event;
  const std::string json = stream.cursor->announcement(event);
  if (json.empty() || !g_utf8_validate(json.data(), static_cast<gssize>(json.size()), nullptr))
    return;
  gst_pad_push_event(
      stream.pad, gst_event_new_custom(GST_EVENT_CUSTOM_DOWNSTREAM_STICKY,
                                       gst_structure_new(take_announcement, "json", G_TYPE_STRING,
                                                         json.c_str(), nullptr)));
}

GstBuffer* make_buffer(TakePacket& packet, bool discont) {
  GstBuffer* buffer = nullptr;
  if (packet.data.empty()) {
    buffer = gst_buffer_new();
  } else {
    auto* data = new std::vector<std::uint8_t>(std::move(packet.data));
    buffer = gst_buffer_new_wrapped_full(
        GST_MEMORY_FLAG_READONLY, data->data(), data->size(), 0, data->size(), data,
        [](gpointer bytes) { delete static_cast<std::vector<std::uint8_t>*>(bytes); });
  }
  GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(packet.time);
  if (packet.duration >= 0)
    GST_BUFFER_DURATION(buffer) = static_cast<GstClockTime>(packet.duration);
  GST_BUFFER_FLAG_SET(buffer, packet.flags & (GST_BUFFER_FLAG_DELTA_UNIT | GST_BUFFER_FLAG_HEADER |
                                              GST_BUFFER_FLAG_GAP));
  if (discont) GST_BUFFER_FLAG_SET(buffer, GST_BUFFER_FLAG_DISCONT);
  return buffer;
}

bool needs_another(const TakePacket& packet) {
  return (packet.flags & GST_BUFFER_FLAG_DELTA_UNIT) != 0;
}

std::optional<TakePacket> first_packet(TakeCursor& cursor) {
  auto first = cursor.next();
  if (!first || !needs_another(*first)) return first;
  const std::int64_t sought = first->time;
  cursor.seek(sought, true);
  do {
    first = cursor.next();
  } while (first && needs_another(*first));
  cursor.seek(first ? first->time : sought);
  return cursor.next();
}

void set_out(Stream& stream, const GstSegment& segment, std::int64_t end) {
  const auto at = static_cast<std::int64_t>(segment.position);
  if (segment.rate < 0) {
    stream.cursor->seek(at < end ? at - 1 : at, true);
  } else {
    // What has begun before may still be seen, or heard.
    stream.cursor->seek(at - 1, true);
    const auto before = stream.cursor->peek();
    stream.cursor->seek(before && before->duration > at - before->time ? before->time : at);
  }
  stream.event = 0;  // behind a flush it is said again
}

}  // namespace polyhull::element
