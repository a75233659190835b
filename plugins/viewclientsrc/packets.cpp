// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/viewclientsrc/packets.h"

#include <regex>
#include <string>

#include "plugins/common/capture_clock.h"
#include "plugins/common/memory/payload_buffer.h"
#include "wire/coded_view.h"
#include "wire/mesh_payload.h"

namespace polyhull::element {

namespace {

// GStreamer's readers descend with each bracket, and keep for good each name that they have not met
// before; and anybody may have written what they read. So they get no more than these: what gdppay
// writes of the formats of views and meshes, and of segments.
const std::regex& caps_form() {
  static const std::regex form(
      R"(application/x-polyhull-(view|mesh)(, framerate=\(fraction\)\d{1,9}/\d{1,9})?;?)");
  return form;
}

const std::regex& segment_form() {
  static const std::regex form(
      R"re(GstEventSegment, segment=\(GstSegment\)"(Gst)?[Ss]egment, flags=\(GstSegmentFlags\)[\w+-]*, )re"
      R"re(rate=\(double\)[\d.e+-]+, applied-rate=\(double\)[\d.e+-]+, format=\(GstFormat\)time)re"
      R"re((, (base|offset|start|stop|time|position|duration)=\(guint64\)\d{1,20}){0,7};?";?)re");
  return form;
}

bool has_form(std::string_view text, const std::regex& form) {
  constexpr std::size_t longest = 1024;  // the library's reader, too, descends
  return text.size() <= longest && std::regex_match(text.begin(), text.end(), form);
}

/// Throws Error for a view that is of another camera, or that takes more of what follows than it may.
void check_limits(const View& view, std::size_t unpacked, const ViewClientSettings& limits) {
  if (!limits.camera.empty() && view.camera != limits.camera)
    throw Error(Error::Kind::bad_input,
                "it is of camera '{}', and expected is '{}'. Set the sender's camera, as of its "
                "silhouette or of capture.sh, or this element's.",
                view.camera, limits.camera);
  if (view.contours.points.size() > limits.max_vertices)
    throw Error(Error::Kind::bad_input,
                "its outlines have {} vertices, and {} are allowed by max-vertices. Look at the "
                "sender's keying and its tolerance.",
                view.contours.points.size(), limits.max_vertices);
  if (unpacked > limits.max_unpacked)
    throw Error(Error::Kind::bad_input,
                "its pixels are {} bytes, and {} are allowed by max-unpacked.", unpacked,
                limits.max_unpacked);
}

}  // namespace

GstCaps* read_caps(std::string_view text) {
  if (!has_form(text, caps_form())) return nullptr;
  return gst_caps_from_string(std::string(text).c_str());
}

bool read_segment(std::string_view text, GstSegment& segment) {
  if (!has_form(text, segment_form())) return false;
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

std::int64_t verify_frame(Bytes bytes, std::string_view format, const ViewClientSettings& limits) {
  const Bytes segments[] = {bytes};
  if (format == view_caps) {
    // Packed pixels go on as they are; viewdecode holds them against their view.
    const CodedView coded = read_coded_view(segments);
    const View& view = coded.view;
    check_limits(view,
                 coded.coding == PixelCoding::raw ? coded.block.size() : coded.shape().bytes(),
                 limits);
    return is_pipelines(view.clock) ? view.capture_time : no_time;
  }
  read_mesh(segments);
  return no_time;  // of a clock that the mesh does not name
}

}  // namespace polyhull::element
