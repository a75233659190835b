// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The background as video for encoders, converted once for as long as it stays the same.
#pragma once

#include <gst/video/video.h>

#include "render/yuv/yuv_picture.h"

namespace polyhull::element {

/// Whether \p info is of a format that composite converts to: NV12 or I420.
inline bool is_video_output(const GstVideoInfo& info) {
  return GST_VIDEO_INFO_FORMAT(&info) == GST_VIDEO_FORMAT_NV12 ||
         GST_VIDEO_INFO_FORMAT(&info) == GST_VIDEO_FORMAT_I420;
}

/// The planes of \p frame, of such a format.
YuvPicture yuv_picture(const GstVideoFrame& frame);

/// For one thread.
class BackgroundVideo {
 public:
  BackgroundVideo();
  ~BackgroundVideo() { reset(); }
  BackgroundVideo(const BackgroundVideo&) = delete;

  /// \p frame (RGBA, as \p from says) in the format \p to: a buffer that nobody writes to any more,
  /// which stays valid until the next call. A frame with the memory of the last one is the same
  /// picture: that is held, so that nobody can have written to it. Throws Error (io) where the frame
  /// cannot be mapped.
  GstBuffer* of(GstBuffer* frame, const GstVideoInfo& from, const GstVideoInfo& to);

  /// How many were converted, ever.
  std::uint64_t conversions() const { return conversions_; }
  void reset();

 private:
  bool is_held(GstBuffer* frame, const GstVideoInfo& to) const;

  GstBuffer* source_ = nullptr;
  GstBuffer* video_ = nullptr;
  GstVideoInfo format_;  // of video_
  std::uint64_t conversions_ = 0;
};

}  // namespace polyhull::element
