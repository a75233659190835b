// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/live/frame_source.h"

#include "plugins/common/log.h"

namespace polyhull::element {

FrameSource::FrameSource(gpointer object) : clock(GST_BASE_SRC(object)) {
  gst_video_info_init(&info);
  gst_base_src_set_format(GST_BASE_SRC(object), GST_FORMAT_TIME);
}

bool FrameSource::set_format(GstBaseSrc* source, GstCaps* caps, const char* refusal) {
  GstVideoInfo parsed;
  if (!gst_video_info_from_caps(&parsed, caps) || GST_VIDEO_INFO_FPS_N(&parsed) <= 0) {
    GST_ELEMENT_ERROR(
        source, STREAM, FORMAT,
        ("%s %" GST_PTR_FORMAT
         ": raw video with a frame rate above 0 is expected. Ask for that in the caps that follow.",
         refusal, static_cast<void*>(caps)),
        (nullptr));
    return false;
  }
  {
    const ObjectLock lock(source);
    info = parsed;
  }
  GST_CAT_DEBUG_OBJECT(category_of(source), source, "makes %" GST_PTR_FORMAT, printed(caps));
  clock.set_rate(GST_VIDEO_INFO_FPS_N(&parsed), GST_VIDEO_INFO_FPS_D(&parsed));
  gst_base_src_set_blocksize(source, static_cast<guint>(parsed.size));
  return true;
}

gboolean FrameSource::answer(GstBaseSrc* source, GstQuery* query, GstBaseSrcClass* parent) {
  if (GST_QUERY_TYPE(query) == GST_QUERY_LATENCY) return clock.answer_latency(query);
  if (GST_QUERY_TYPE(query) != GST_QUERY_CONVERT) return parent->query(source, query);
  GstFormat from, to;
  gint64 value = 0, result = 0;
  gst_query_parse_convert(query, &from, &value, &to, nullptr);
  const GstVideoInfo format = snapshot(source, info);
  if (GST_VIDEO_INFO_FORMAT(&format) == GST_VIDEO_FORMAT_UNKNOWN ||
      !gst_video_info_convert(&format, from, value, to, &result))
    return FALSE;
  gst_query_set_convert(query, from, value, to, result);
  return TRUE;
}

void FrameSource::start(GstElement* element) {
  {
    const ObjectLock lock(element);
    gst_video_info_init(&info);
  }
  clock.reset();
}

}  // namespace polyhull::element
