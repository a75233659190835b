// SPDX-License-Identifier: LGPL-2.1-or-later
// rigtestsrc's negotiation: the size is the camera's, the formats are the output's.
#include "plugins/common/memory/video_pool.h"
#include "plugins/rigtestsrc/private.h"

namespace polyhull::element {
namespace {

constexpr const char* picture_formats =
    "video/x-raw, format={ RGBx, BGRx, RGBA, BGRA, I420, NV12, YUY2, UYVY }";

GstBaseSrcClass* parent() {
  return GST_BASE_SRC_CLASS(parent_class<RigTestSrc>());
}

}  // namespace

GstCaps* rig_test_get_caps(GstBaseSrc* source, GstCaps* filter) {
  RigTestSrc& self = state_of<RigTestSrc>(source);
  g_autoptr(GstCaps) caps =
      gst_caps_make_writable(gst_pad_get_pad_template_caps(GST_BASE_SRC_PAD(source)));
  RigOutput output = snapshot(source, self.settings).output;
  {
    const ObjectLock lock(source);
    if (self.stream.drawing.picture) {
      const Camera& camera = self.stream.drawing.picture->camera();
      output = self.stream.output;
      gst_caps_set_simple(caps, "width", G_TYPE_INT, camera.width, "height", G_TYPE_INT,
                          camera.height, nullptr);
    }
  }
  const char* formats = output == RigOutput::picture ? picture_formats
                        : output == RigOutput::keyed ? "video/x-raw, format={ RGBA, BGRA }"
                        : output == RigOutput::matte ? "video/x-raw, format=GRAY8"
                                                     : "video/x-raw, format=GRAY16_LE";
  g_autoptr(GstCaps) allowed = gst_caps_from_string(formats);
  return filtered(filtered(g_steal_pointer(&caps), allowed), filter);
}

GstCaps* rig_test_fixate(GstBaseSrc* source, GstCaps* caps) {
  caps = gst_caps_make_writable(caps);
  GstStructure* structure = gst_caps_get_structure(caps, 0);
  gst_structure_fixate_field_nearest_fraction(structure, "framerate", 25, 1);
  caps = parent()->fixate(source, caps);
  // Say outright what the format leaves to convention: the colours' coding and where the chroma
  // lies.
  GstVideoInfo info;
  if (!gst_video_info_from_caps(&info, caps)) return caps;
  g_autoptr(GstCaps) full = gst_video_info_to_caps(&info);
  caps = gst_caps_make_writable(caps);
  structure = gst_caps_get_structure(caps, 0);
  for (const char* field : {"pixel-aspect-ratio", "interlace-mode", "colorimetry", "chroma-site"}) {
    const GValue* value = gst_structure_get_value(gst_caps_get_structure(full, 0), field);
    if (value != nullptr && !gst_structure_has_field(structure, field)) {
      gst_structure_set_value(structure, field, value);
    }
  }
  if (GST_VIDEO_INFO_IS_YUV(&info) && !gst_structure_has_field(structure, "chroma-site")) {
    gst_structure_set(structure, "chroma-site", G_TYPE_STRING, "mpeg2", nullptr);
  }
  return caps;
}

gboolean rig_test_negotiate(GstBaseSrc* source) {
  GstPad* pad = GST_BASE_SRC_PAD(source);
  g_autoptr(GstCaps) offered = gst_pad_query_caps(pad, nullptr);
  g_autoptr(GstCaps) possible = gst_pad_peer_query_caps(pad, offered);
  const bool none = gst_caps_is_empty(possible);
  if (none) {
    g_autoptr(GstCaps) wanted = gst_pad_peer_query_caps(pad, nullptr);
    g_autofree gchar* wanted_text = gst_caps_to_string(wanted);
    g_autofree gchar* offered_text = gst_caps_to_string(offered);
    GST_ELEMENT_ERROR(
        source, STREAM, FORMAT,
        ("What follows does not take the picture of this camera, whose size is the "
         "rig's. It offers %s; wanted is %s. Take the "
         "size out of the caps that follow, or put a videoscale and a videoconvert between.",
         offered_text, wanted_text),
        (nullptr));
  }
  return !none && parent()->negotiate(source);
}

gboolean rig_test_decide_allocation(GstBaseSrc* source, GstQuery* query) {
  return decide_video_pool(query, nullptr) && parent()->decide_allocation(source, query);
}

}  // namespace polyhull::element
