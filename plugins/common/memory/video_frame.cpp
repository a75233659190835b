// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/memory/video_frame.h"

#include <string>
#include <utility>

#include "base/error.h"

namespace polyhull::element {
namespace {

FrameFormat format_of(GstVideoFormat format) {
  constexpr std::pair<GstVideoFormat, FrameFormat> known[] = {
      {GST_VIDEO_FORMAT_RGBx, FrameFormat::rgbx},
      {GST_VIDEO_FORMAT_BGRx, FrameFormat::bgrx},
      {GST_VIDEO_FORMAT_RGBA, FrameFormat::rgba},
      {GST_VIDEO_FORMAT_BGRA, FrameFormat::bgra},
      {GST_VIDEO_FORMAT_RGB, FrameFormat::rgb},
      {GST_VIDEO_FORMAT_BGR, FrameFormat::bgr},
      {GST_VIDEO_FORMAT_GRAY8, FrameFormat::gray8},
      {GST_VIDEO_FORMAT_I420, FrameFormat::i420},
      {GST_VIDEO_FORMAT_NV12, FrameFormat::nv12},
      {GST_VIDEO_FORMAT_YUY2, FrameFormat::yuy2},
      {GST_VIDEO_FORMAT_UYVY, FrameFormat::uyvy},
      {GST_VIDEO_FORMAT_I420_10LE, FrameFormat::i420_10le},
      {GST_VIDEO_FORMAT_v210, FrameFormat::v210}};
  for (const auto& [theirs, ours] : known)
    if (theirs == format) return ours;
  throw Error(Error::Kind::unsupported,
              "The video format {} cannot be keyed; put a videoconvert in front.",
              gst_video_format_to_string(format));
}

ColourMatrix matrix_of(const GstVideoInfo& info) {
  switch (GST_VIDEO_INFO_COLORIMETRY(&info).matrix) {
    case GST_VIDEO_COLOR_MATRIX_BT709:
    case GST_VIDEO_COLOR_MATRIX_SMPTE240M:  // nearest of the three; differs by 0.01 in Kr
      return ColourMatrix::bt709;
    case GST_VIDEO_COLOR_MATRIX_BT2020:
      return ColourMatrix::bt2020;
    default:
      return ColourMatrix::bt601;
  }
}

ChromaSite site_of(const GstVideoInfo& info) {
  const GstVideoChromaSite site = GST_VIDEO_INFO_CHROMA_SITE(&info);
  if (site == GST_VIDEO_CHROMA_SITE_UNKNOWN) return ChromaSite::left;
  const bool horizontal = (site & GST_VIDEO_CHROMA_SITE_H_COSITED) != 0;
  const bool vertical = (site & GST_VIDEO_CHROMA_SITE_V_COSITED) != 0;
  if (vertical) return horizontal ? ChromaSite::top_left : ChromaSite::top;
  return horizontal ? ChromaSite::left : ChromaSite::centre;
}

}  // namespace

FrameView frame_template(const GstVideoInfo& info) {
  FrameView layout;
  layout.format = format_of(GST_VIDEO_INFO_FORMAT(&info));
  layout.width = GST_VIDEO_INFO_WIDTH(&info);
  layout.height = GST_VIDEO_INFO_HEIGHT(&info);
  layout.matrix = matrix_of(info);
  layout.full_range = GST_VIDEO_INFO_COLORIMETRY(&info).range == GST_VIDEO_COLOR_RANGE_0_255;
  layout.site = site_of(info);
  return layout;
}

FrameView frame_view(const FrameView& layout, const GstVideoFrame& frame) {
  FrameView view = layout;
  for (guint plane = 0; plane < GST_VIDEO_FRAME_N_PLANES(&frame); ++plane) {
    view.planes[plane] =
        static_cast<const std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, plane));
    view.strides[plane] = GST_VIDEO_FRAME_PLANE_STRIDE(&frame, plane);
  }
  return view;
}

MappedFrame::MappedFrame(const GstVideoInfo& info, GstBuffer* buffer, GstMapFlags flags) {
  // No reference is added: the caller holds the buffer while this object lives.
  const auto without_ref = static_cast<GstMapFlags>(
      static_cast<int>(flags) | static_cast<int>(GST_VIDEO_FRAME_MAP_FLAG_NO_REF));
  if (!gst_video_frame_map(&frame_, &info, buffer, without_ref)) {
    throw Error(Error::Kind::io,
                "A buffer of {} bytes cannot be mapped as a frame of the {} bytes that its caps "
                "announce; look at the element in front.",
                gst_buffer_get_size(buffer), GST_VIDEO_INFO_SIZE(&info));
  }
}

MappedFrame::~MappedFrame() {
  gst_video_frame_unmap(&frame_);
}

}  // namespace polyhull::element
