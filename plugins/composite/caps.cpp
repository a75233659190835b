// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/composite/caps.h"

#include <initializer_list>

#include "plugins/common/element.h"

namespace polyhull::element {
namespace {

GstCaps* with_both_memories(const GstCaps* shape, bool gpu_first) {
  GstCaps* gpu = gst_caps_copy(shape);
  gst_caps_set_features_simple(gpu,
                               gst_caps_features_from_string(GST_CAPS_FEATURE_MEMORY_GL_MEMORY));
  gst_caps_set_simple(gpu, "texture-target", G_TYPE_STRING, "2D", nullptr);
  GstCaps* system = gst_caps_copy(shape);
  return gpu_first ? gst_caps_merge(gpu, system) : gst_caps_merge(system, gpu);
}

}  // namespace

bool is_gl_caps(const GstCaps* caps) {
  const GstCapsFeatures* features = gst_caps_get_features(caps, 0);
  return features && gst_caps_features_contains(features, GST_CAPS_FEATURE_MEMORY_GL_MEMORY);
}

GstCaps* output_caps(const GstVideoInfo& info, bool background_on_gpu) {
  g_autoptr(GstCaps) shape = gst_video_info_to_caps(const_cast<GstVideoInfo*>(&info));
  gst_structure_remove_field(gst_caps_get_structure(shape, 0), "texture-target");
  GstCaps* video = gst_caps_copy(shape);
  g_autoptr(GstCaps) format = gst_caps_from_string(
      "video/x-raw, format=(string){NV12,I420}, colorimetry=(string)bt709, "
      "chroma-site=(string)mpeg2");
  for (const char* field : {"format", "colorimetry", "chroma-site"})
    gst_caps_set_value(video, field,
                       gst_structure_get_value(gst_caps_get_structure(format, 0), field));
  return gst_caps_merge(with_both_memories(shape, background_on_gpu), video);
}

void answer_background_caps(GstPad* source, GstQuery* query) {
  GstCaps* filter = nullptr;
  gst_query_parse_caps(query, &filter);
  g_autoptr(GstCaps) both = nullptr;
  g_autoptr(GstCaps) peer = gst_pad_peer_query_caps(source, nullptr);
  if (peer && !gst_caps_is_any(peer)) {
    // Of what comes after, only the shape of the picture counts here.
    g_autoptr(GstCaps) shapes = gst_caps_new_empty();
    for (guint i = 0; i < gst_caps_get_size(peer); ++i) {
      const GstStructure* from = gst_caps_get_structure(peer, i);
      if (!gst_structure_has_name(from, "video/x-raw")) continue;
      GstStructure* shape = gst_structure_new_empty("video/x-raw");
      for (const char* field : {"width", "height", "framerate", "pixel-aspect-ratio"}) {
        if (const GValue* value = gst_structure_get_value(from, field))
          gst_structure_set_value(shape, field, value);
      }
      gst_caps_append_structure(shapes, shape);
    }
    both = with_both_memories(shapes, false);
  }
  // Whatever the filter's order: what need not be converted comes first.
  g_autoptr(GstCaps) result = gst_caps_new_empty();
  for (const char* kind : {picture_caps, converted_caps})
    gst_caps_append(result, filtered(filtered(gst_caps_from_string(kind), both), filter));
  gst_query_set_caps_result(query, result);
}

}  // namespace polyhull::element
