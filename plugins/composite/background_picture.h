// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The background as RGBA, whatever video format it comes in, converted once for as long as it stays
/// the same.
#pragma once

#include <gst/video/video.h>

#include "plugins/common/statistics.h"

namespace polyhull::element {

/// For one thread.
class BackgroundPicture {
 public:
  /// Counts conversions in \p statistics: backgrounds-converted.
  explicit BackgroundPicture(Statistics& statistics);
  ~BackgroundPicture();
  BackgroundPicture(const BackgroundPicture&) = delete;

  /// Frames are as \p caps say from now on; false: these are of no video.
  bool set_format(const GstCaps* caps);

  /// Of of()'s result: RGBA of that size, shape and rate.
  const GstVideoInfo& info() const { return info_; }

  /// \p frame, whose reference it takes, as RGBA with the same times and metas: itself where it is
  /// that. A frame with the memory of the last one is the same picture, and comes in the same memory
  /// again: both are held, so that nobody can have written to them. Of a frame that is the caller's
  /// alone the result is, too. Throws Error: io where the frame cannot be mapped, unsupported where
  /// its format cannot be converted.
  GstBuffer* of(GstBuffer* frame);

  /// Lets go of all frames; the format is none.
  void reset();

 private:
  GstBuffer* converted(GstBuffer* frame);
  void let_go();

  Statistics& statistics_;
  GstVideoInfo source_info_, info_;
  GstVideoConverter* converter_ = nullptr;  // null: not needed yet
  GstAllocator* allocator_;
  GstBuffer* source_ = nullptr;   // the last frame that can come again; null: none
  GstBuffer* picture_ = nullptr;  // that as RGBA
};

}  // namespace polyhull::element
