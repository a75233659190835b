// SPDX-License-Identifier: LGPL-2.1-or-later
// rigtestsrc's negotiation: the size is the camera's, the formats are the output's.
#include "plugins/common/memory/video_pool.h"
#include "plugins/rigtestsrc/private.h"

namespace polyhull::element {
namespace {

constexpr const char* picture_formats = "{ RGBx, BGRx, RGBA, BGRA, I420, NV12, YUY2, UYVY }";

}  // namespace

GstCaps* rig_test_get_caps(GstBaseSrc* source, GstCaps* filter) {
  RigTestState& state = *RIG_TEST_SRC(source)->state;
  GstCaps* caps = gst_pad_get_pad_template_caps(GST_BASE_SRC_PAD(source));
  caps = gst_caps_make_writable(caps);
  GST_OBJECT_LOCK(source);
  RigOutput output = state.settings.output;
  if (state.stream.drawing.picture) {
    const Camera& camera = state.stream.drawing.picture->camera();
    output = state.stream.output;
    gst_caps_set_simple(caps, "width", G_TYPE_INT, camera.width, "height", G_TYPE_INT,
                        camera.height, nullptr);
  }
  GST_OBJECT_UNLOCK(source);
  GValue formats = G_VALUE_INIT;
  const char* allowed = output == RigOutput::picture ? picture_formats
                        : output == RigOutput::keyed ? "{ RGBA, BGRA }"
                        : output == RigOutput::matte ? "GRAY8"
                                                     : "GRAY16_LE";
  if (*allowed == '{') {
    g_value_init(&formats, GST_TYPE_LIST);
  } else {
    g_value_init(&formats, G_TYPE_STRING);
  }
  gst_value_deserialize(&formats, allowed);
  gst_caps_set_value(caps, "format", &formats);
  g_value_unset(&formats);
  if (filter != nullptr) {
    GstCaps* both = gst_caps_intersect_full(filter, caps, GST_CAPS_INTERSECT_FIRST);
    gst_caps_unref(caps);
    caps = both;
  }
  return caps;
}

GstCaps* rig_test_fixate(GstBaseSrc* source, GstCaps* caps, GstBaseSrcClass* parent) {
  caps = gst_caps_make_writable(caps);
  GstStructure* structure = gst_caps_get_structure(caps, 0);
  gst_structure_fixate_field_nearest_fraction(structure, "framerate", 25, 1);
  caps = parent->fixate(source, caps);
  // Say outright what the format leaves to convention: the colours' coding and where the chroma
  // lies.
  GstVideoInfo info;
  if (!gst_video_info_from_caps(&info, caps)) return caps;
  GstCaps* full = gst_video_info_to_caps(&info);
  caps = gst_caps_make_writable(caps);
  structure = gst_caps_get_structure(caps, 0);
  for (const char* field : {"pixel-aspect-ratio", "interlace-mode", "colorimetry", "chroma-site"}) {
    const GValue* value = gst_structure_get_value(gst_caps_get_structure(full, 0), field);
    if (value != nullptr && !gst_structure_has_field(structure, field)) {
      gst_structure_set_value(structure, field, value);
    }
  }
  gst_caps_unref(full);
  if (GST_VIDEO_INFO_IS_YUV(&info) && !gst_structure_has_field(structure, "chroma-site")) {
    gst_structure_set(structure, "chroma-site", G_TYPE_STRING, "mpeg2", nullptr);
  }
  return caps;
}

gboolean rig_test_set_caps(GstBaseSrc* source, GstCaps* caps) {
  RigTestState& state = *RIG_TEST_SRC(source)->state;
  GstVideoInfo info;
  if (!gst_video_info_from_caps(&info, caps) || GST_VIDEO_INFO_FPS_N(&info) <= 0) {
    GST_ELEMENT_ERROR(source, STREAM, FORMAT,
                      ("A rig's camera cannot deliver %" GST_PTR_FORMAT
                       ": raw video with a frame rate above 0 is expected.",
                       static_cast<void*>(caps)),
                      (nullptr));
    return FALSE;
  }
  GST_OBJECT_LOCK(source);
  state.stream.info = info;
  GST_OBJECT_UNLOCK(source);
  state.clock.set_rate(GST_VIDEO_INFO_FPS_N(&info), GST_VIDEO_INFO_FPS_D(&info));
  gst_base_src_set_blocksize(source, static_cast<guint>(info.size));
  return TRUE;
}

gboolean rig_test_negotiate(GstBaseSrc* source, GstBaseSrcClass* parent) {
  GstPad* pad = GST_BASE_SRC_PAD(source);
  GstCaps* offered = gst_pad_query_caps(pad, nullptr);
  GstCaps* possible = gst_pad_peer_query_caps(pad, offered);
  const bool none = gst_caps_is_empty(possible);
  gst_caps_unref(possible);
  if (none) {
    GstCaps* wanted = gst_pad_peer_query_caps(pad, nullptr);
    gchar* wanted_text = gst_caps_to_string(wanted);
    gchar* offered_text = gst_caps_to_string(offered);
    GST_ELEMENT_ERROR(
        source, STREAM, FORMAT,
        ("What follows does not take the picture of this camera, whose size is the rig's. It "
         "offers %s; wanted is %s.",
         offered_text, wanted_text),
        (nullptr));
    g_free(offered_text);
    g_free(wanted_text);
    gst_caps_unref(wanted);
  }
  gst_caps_unref(offered);
  return !none && parent->negotiate(source);
}

gboolean rig_test_decide_allocation(GstBaseSrc* source, GstQuery* query, GstBaseSrcClass* parent) {
  return decide_video_pool(query, nullptr) && parent->decide_allocation(source, query);
}

}  // namespace polyhull::element
