// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// One stream of a take that is played: its pad, its place in the file, and what is sent of it.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <optional>
#include <string>

#include "take/take_reader.h"

namespace polyhull::element {

/// One pad. All but `pad` belongs to its thread, and while that is stopped to who stopped it.
struct Stream {
  GstPad* pad = nullptr;
  std::optional<TakeCursor> cursor;
  std::string caps;        // that were sent
  std::int64_t event = 0;  // whose announcement was sent
  bool started = false;    // its stream-start was sent
  bool segment_due = true;
  bool discont = true;
  std::uint64_t damaged = 0;  // of the cursor, that were told
};

/// What comes from now on is of these caps. Throws Error where they are none.
void send_caps(Stream& stream, const std::string& text);

/// What comes from now on was announced by \p event (TakePacket::event).
void send_announcement(Stream& stream, std::int64_t event);

/// Takes the packet's data.
GstBuffer* make_buffer(TakePacket& packet, bool discont);

/// Whether it is decoded from the one before it.
bool needs_another(const TakePacket& packet);

/// The first packet after a seek, or what has to be decoded before it.
std::optional<TakePacket> first_packet(TakeCursor& cursor);

/// Sets the stream, whose thread stands, to where \p segment goes on. \p end: of the take, where a last
/// buffer may lie that lasts no time. Nothing is unpacked here: each stream's thread does that.
void set_out(Stream& stream, const GstSegment& segment, std::int64_t end);

}  // namespace polyhull::element
