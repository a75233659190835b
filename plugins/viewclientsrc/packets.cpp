// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/viewclientsrc/packets.h"

#include <string>

#include "plugins/common/memory/payload_buffer.h"
#include "wire/coded_view.h"
#include "wire/mesh_payload.h"

namespace polyhull::element {

namespace {

/// GStreamer's readers descend with each bracket, and anybody may have written what they read.
bool nests(std::string_view text) {
  return text.find_first_of("{[<") != std::string_view::npos;
}

}  // namespace

GstCaps* read_caps(std::string_view text) {
  if (nests(text)) return nullptr;
  GstCaps* caps = gst_caps_from_string(std::string(text).c_str());
  if (caps == nullptr) return nullptr;
  if (gst_caps_is_fixed(caps)) {
    const GstStructure* structure = gst_caps_get_structure(caps, 0);
    for (const char* known : {view_caps, mesh_caps})
      if (gst_structure_has_name(structure, known)) return caps;
  }
  gst_caps_unref(caps);
  return nullptr;
}

bool read_segment(std::string_view text, GstSegment& segment) {
  constexpr std::string_view begin = "GstEventSegment, segment=(GstSegment)";
  if (!text.starts_with(begin) || nests(text)) return false;
  GstStructure* structure = gst_structure_from_string(std::string(text).c_str(), nullptr);
  if (structure == nullptr) return false;
  const GValue* value = gst_structure_get_value(structure, "segment");
  const bool found = value != nullptr && G_VALUE_HOLDS(value, GST_TYPE_SEGMENT) &&
                     g_value_get_boxed(value) != nullptr;
  GstSegment read;
  if (found) gst_segment_copy_into(static_cast<const GstSegment*>(g_value_get_boxed(value)), &read);
  gst_structure_free(structure);
  if (!found || read.format != GST_FORMAT_TIME || !(read.rate > 0.0)) return false;
  segment = read;
  return true;
}

std::int64_t verify_frame(Bytes bytes, std::string_view format) {
  const Bytes segments[] = {bytes};
  if (format == view_caps) {
    // Packed pixels go on as they are; viewdecode holds them against their view.
    const View view = read_coded_view(segments).view;
    const bool pipelines =
        view.clock == CaptureClock::arrival || view.clock == CaptureClock::pipeline;
    return pipelines ? view.capture_time : no_time;
  }
  read_mesh(segments);
  return no_time;  // of a clock that the mesh does not name
}

}  // namespace polyhull::element
