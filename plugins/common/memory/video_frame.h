// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// GStreamer's video formats and mapped frames as the library's.
#pragma once

#include <gst/video/video.h>

#include "plugins/common/statistics.h"
#include "silhouette/pixels/frame.h"

/// Caps that chromamatte and silhouette take; fastest first.
#define POLYHULL_KEYABLE_CAPS                                                                    \
  GST_VIDEO_CAPS_MAKE(                                                                           \
      "{ NV12, I420, BGRx, RGBx, BGRA, RGBA, YUY2, UYVY, RGB, BGR, I420_10LE, v210, "            \
      "NV21, YV12, Y42B, NV16, NV61, YVYU, Y444, NV24, v308, AYUV, VUYA, A420, "                 \
      "P010_10LE, I422_10LE, Y444_10LE, A420_10LE, A422_10LE, A444_10LE, P012_LE, "              \
      "I420_12LE, I422_12LE, Y444_12LE, xRGB, xBGR, ARGB, ABGR, GBR, GBRA, GBR_10LE, GBR_12LE, " \
      "GRAY8 }")                                                                                 \
  "; video/x-bayer, format=(string){ bggr, gbrg, grbg, rggb, bggr10le, gbrg10le, "               \
  "grbg10le, rggb10le, bggr12le, gbrg12le, grbg12le, rggb12le }, "                               \
  "width=" GST_VIDEO_SIZE_RANGE ", height=" GST_VIDEO_SIZE_RANGE                                 \
  ", framerate=" GST_VIDEO_FPS_RANGE

namespace polyhull::element {

/// Whether \p caps are a colour sensor's mosaic (video/x-bayer) that can be keyed.
bool is_mosaic(const GstCaps* caps);

/// Size, rate and memory of frames of \p caps, a mosaic's (video/x-bayer) as those of grey ones;
/// false: not video that is known.
bool video_info_of(const GstCaps* caps, GstVideoInfo* info);

/// Format, size and colorimetry without planes of frames of \p caps, of which \p info is what
/// video_info_of() gave. Colorimetry that the caps leave open is what GStreamer assumes for the size
/// (BT.601 below HD, BT.709 from there on).
/// Throws Error (unsupported) for a format that cannot be keyed, and for interlaced frames.
FrameView frame_template(const GstCaps* caps, const GstVideoInfo& info);

/// Warns on \p element, counted as colours-unconverted, where frames of \p info have other colours than
/// BT.709's, to which nothing here converts them: high dynamic range (HLG, PQ), as phones record it, or
/// the primaries of BT.2020.
void warn_of_wide_colours(GstElement* element, Statistics& statistics, const GstVideoInfo& info);

/// \p layout with the planes of \p frame, which must stay mapped while the result is used.
FrameView frame_view(const FrameView& layout, const GstVideoFrame& frame);

/// A buffer mapped as a video frame, unmapped when it goes out of scope.
class MappedFrame {
 public:
  /// Throws Error (io) where the buffer cannot be mapped or is too small for \p info.
  MappedFrame(const GstVideoInfo& info, GstBuffer* buffer, GstMapFlags flags = GST_MAP_READ);
  ~MappedFrame();
  MappedFrame(const MappedFrame&) = delete;
  MappedFrame& operator=(const MappedFrame&) = delete;
  const GstVideoFrame& frame() const { return frame_; }
  /// Of the first plane.
  std::uint8_t* data() const { return static_cast<std::uint8_t*>(frame_.data[0]); }
  int stride() const { return GST_VIDEO_FRAME_PLANE_STRIDE(&frame_, 0); }
  /// Of a frame mapped with GST_MAP_GL.
  guint texture() const { return *static_cast<const guint*>(frame_.data[0]); }

 private:
  void map_plain(const GstVideoInfo& info, const GstVideoMeta& meta, GstBuffer* buffer,
                 GstMapFlags flags);

  GstVideoFrame frame_;
  bool plain_ = false;  // mapped as bytes
};

}  // namespace polyhull::element
