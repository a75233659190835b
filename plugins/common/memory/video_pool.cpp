// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/memory/video_pool.h"

#include <gst/video/gstvideopool.h>
#include <gst/video/video.h>

#include <algorithm>

namespace polyhull::element {

bool decide_video_pool(GstQuery* query, GstGLContext* context) {
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
  const bool metas = gst_query_find_allocation_meta(query, GST_VIDEO_META_API_TYPE, nullptr);
  const bool sync = gst_query_find_allocation_meta(query, GST_GL_SYNC_META_API_TYPE, nullptr);
  const auto configure = [&] {
    GstStructure* config = gst_buffer_pool_get_config(pool);
    gst_buffer_pool_config_set_params(config, caps, size, least, most);
    if (metas || context)
      gst_buffer_pool_config_add_option(config, GST_BUFFER_POOL_OPTION_VIDEO_META);
    if (context && sync)
      gst_buffer_pool_config_add_option(config, GST_BUFFER_POOL_OPTION_GL_SYNC_META);
    return gst_buffer_pool_set_config(pool, config);
  };
  // A pool of another kind of memory is of no use.
  const bool fits = pool && GST_IS_GL_BUFFER_POOL(pool) == (context != nullptr) &&
                    (!context || GST_GL_BUFFER_POOL(pool)->context == context);
  if (!fits || !configure()) {
    gst_clear_object(&pool);
    pool = context ? gst_gl_buffer_pool_new(context) : gst_video_buffer_pool_new();
    if (!configure()) {
      gst_object_unref(pool);
      return false;
    }
  }
  if (offered) {
    gst_query_set_nth_allocation_pool(query, 0, pool, size, least, most);
  } else {
    gst_query_add_allocation_pool(query, pool, size, least, most);
  }
  gst_object_unref(pool);
  return true;
}

}  // namespace polyhull::element
