// SPDX-License-Identifier: LGPL-2.1-or-later
#include "composite_caps.h"

#include <gst/video/gstvideopool.h>

#include <algorithm>

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
  GstCaps* shape = gst_video_info_to_caps(const_cast<GstVideoInfo*>(&info));
  gst_structure_remove_field(gst_caps_get_structure(shape, 0), "texture-target");
  GstCaps* caps = with_both_memories(shape, background_on_gpu);
  gst_caps_unref(shape);
  return caps;
}

void answer_background_caps(GstPad* pad, GstPad* source, GstQuery* query) {
  GstCaps* filter = nullptr;
  gst_query_parse_caps(query, &filter);
  GstCaps* own = gst_pad_get_pad_template_caps(pad);
  GstCaps* peer = gst_pad_peer_query_caps(source, nullptr);
  GstCaps* result = nullptr;
  if (peer && !gst_caps_is_any(peer)) {
    // Of what comes after, only the shape of the picture counts here.
    GstCaps* shapes = gst_caps_new_empty();
    for (guint i = 0; i < gst_caps_get_size(peer); ++i) {
      const GstStructure* from = gst_caps_get_structure(peer, i);
      if (!gst_structure_has_name(from, "video/x-raw")) continue;
      GstStructure* shape =
          gst_structure_new("video/x-raw", "format", G_TYPE_STRING, "RGBA", nullptr);
      for (const char* field : {"width", "height", "framerate", "pixel-aspect-ratio"}) {
        if (const GValue* value = gst_structure_get_value(from, field))
          gst_structure_set_value(shape, field, value);
      }
      gst_caps_append_structure(shapes, shape);
    }
    GstCaps* both = with_both_memories(shapes, false);
    result = gst_caps_intersect_full(both, own, GST_CAPS_INTERSECT_FIRST);
    gst_caps_unref(both);
    gst_caps_unref(shapes);
  } else {
    result = gst_caps_ref(own);
  }
  if (filter) {
    GstCaps* filtered = gst_caps_intersect_full(filter, result, GST_CAPS_INTERSECT_FIRST);
    gst_caps_unref(result);
    result = filtered;
  }
  gst_query_set_caps_result(query, result);
  gst_caps_unref(result);
  gst_caps_unref(own);
  gst_clear_caps(&peer);
}

bool decide_pool(GstQuery* query, GstGLContext* context) {
  GstCaps* caps = nullptr;
  gst_query_parse_allocation(query, &caps, nullptr);
  GstVideoInfo info;
  if (!caps || !gst_video_info_from_caps(&info, caps)) return false;

  GstBufferPool* pool = nullptr;
  guint size = static_cast<guint>(info.size), least = 0, most = 0;
  const bool offered = gst_query_get_n_allocation_pools(query) > 0;
  if (offered) {
    gst_query_parse_nth_allocation_pool(query, 0, &pool, &size, &least, &most);
    size = std::max(size, static_cast<guint>(info.size));
  }
  // A pool of another kind of memory is of no use.
  if (pool && (GST_IS_GL_BUFFER_POOL(pool) != (context != nullptr) ||
               (context && GST_GL_BUFFER_POOL(pool)->context != context)))
    gst_clear_object(&pool);
  if (!pool) pool = context ? gst_gl_buffer_pool_new(context) : gst_video_buffer_pool_new();
  GstStructure* config = gst_buffer_pool_get_config(pool);
  gst_buffer_pool_config_set_params(config, caps, size, least, most);
  const bool metas = gst_query_find_allocation_meta(query, GST_VIDEO_META_API_TYPE, nullptr);
  if (metas || context)
    gst_buffer_pool_config_add_option(config, GST_BUFFER_POOL_OPTION_VIDEO_META);
  if (context && gst_query_find_allocation_meta(query, GST_GL_SYNC_META_API_TYPE, nullptr))
    gst_buffer_pool_config_add_option(config, GST_BUFFER_POOL_OPTION_GL_SYNC_META);
  const bool good = gst_buffer_pool_set_config(pool, config);
  if (good) {
    if (offered) {
      gst_query_set_nth_allocation_pool(query, 0, pool, size, least, most);
    } else {
      gst_query_add_allocation_pool(query, pool, size, least, most);
    }
  }
  gst_object_unref(pool);
  return good;
}

}  // namespace polyhull::element
