// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/composite/background_video.h"

#include "plugins/common/memory/video_frame.h"
#include "plugins/composite/background_content.h"

namespace polyhull::element {
YuvPicture yuv_picture(const GstVideoFrame& frame) {
  const auto component = [&](guint k) {
    return static_cast<std::uint8_t*>(GST_VIDEO_FRAME_COMP_DATA(&frame, k));
  };
  YuvPicture out;
  out.width = GST_VIDEO_FRAME_WIDTH(&frame);
  out.height = GST_VIDEO_FRAME_HEIGHT(&frame);
  out.y = component(0);
  out.y_stride = GST_VIDEO_FRAME_COMP_STRIDE(&frame, 0);
  out.cb = component(1);
  out.cr = component(2);
  out.chroma_stride = GST_VIDEO_FRAME_COMP_STRIDE(&frame, 1);
  out.chroma_step = GST_VIDEO_FRAME_COMP_PSTRIDE(&frame, 1);
  return out;
}

BackgroundVideo::BackgroundVideo() {
  gst_video_info_init(&format_);
}

bool BackgroundVideo::is_held(GstBuffer* frame, const GstVideoInfo& to) const {
  return source_ != nullptr && same_memory(source_, frame) &&
         gst_video_info_is_equal(&format_, &to);
}

GstBuffer* BackgroundVideo::of(GstBuffer* frame, const GstVideoInfo& from, const GstVideoInfo& to) {
  if (is_held(frame, to)) return video_;
  reset();
  {
    g_autoptr(GstBuffer) made = gst_buffer_new_allocate(nullptr, to.size, nullptr);
    const MappedFrame picture(from, frame);
    const MappedFrame video(to, made, GST_MAP_WRITE);
    write_yuv(picture.data(), picture.stride(), yuv_picture(video.frame()));
    video_ = gst_buffer_ref(made);
  }
  source_ = gst_buffer_ref(frame);
  format_ = to;
  ++conversions_;
  return video_;
}

void BackgroundVideo::reset() {
  gst_clear_buffer(&source_);
  gst_clear_buffer(&video_);
}

}  // namespace polyhull::element
