// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/memory/video_frame.h"

#include <string>

#include "base/error.h"

namespace polyhull::element {
namespace {

FrameFormat format_of(GstVideoFormat format) {
  switch (format) {
    case GST_VIDEO_FORMAT_RGBx:
      return FrameFormat::rgbx;
    case GST_VIDEO_FORMAT_BGRx:
      return FrameFormat::bgrx;
    case GST_VIDEO_FORMAT_RGBA:
      return FrameFormat::rgba;
    case GST_VIDEO_FORMAT_BGRA:
      return FrameFormat::bgra;
    case GST_VIDEO_FORMAT_RGB:
      return FrameFormat::rgb;
    case GST_VIDEO_FORMAT_BGR:
      return FrameFormat::bgr;
    case GST_VIDEO_FORMAT_GRAY8:
      return FrameFormat::gray8;
    case GST_VIDEO_FORMAT_I420:
      return FrameFormat::i420;
    case GST_VIDEO_FORMAT_NV12:
      return FrameFormat::nv12;
    case GST_VIDEO_FORMAT_YUY2:
      return FrameFormat::yuy2;
    case GST_VIDEO_FORMAT_UYVY:
      return FrameFormat::uyvy;
    case GST_VIDEO_FORMAT_I420_10LE:
      return FrameFormat::i420_10le;
    case GST_VIDEO_FORMAT_v210:
      return FrameFormat::v210;
    default:
      throw Error(Error::Kind::unsupported, std::string("The video format ") +
                                                gst_video_format_to_string(format) +
                                                " cannot be keyed; put a videoconvert in front.");
  }
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
                "A buffer of " + std::to_string(gst_buffer_get_size(buffer)) +
                    " bytes cannot be mapped as a frame of the " +
                    std::to_string(GST_VIDEO_INFO_SIZE(&info)) +
                    " bytes that its caps announce; look at the element in front.");
  }
}

MappedFrame::~MappedFrame() {
  gst_video_frame_unmap(&frame_);
}

}  // namespace polyhull::element
