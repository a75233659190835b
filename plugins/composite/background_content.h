// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which frames of the background are the same picture, told by their memory.
#pragma once

#include <gst/gst.h>

#include <cstdint>

namespace polyhull::element {

/// Whether both lie in the same memory in the same way.
bool same_memory(GstBuffer* a, GstBuffer* b);

/// Whether \p frame and its memory are the caller's alone, who may draw into it: nobody else can send
/// or write it.
bool is_sole_owner(GstBuffer* frame);

/// Numbers the pictures of frame after frame. For one thread.
class BackgroundContent {
 public:
  BackgroundContent() = default;
  ~BackgroundContent() { reset(); }
  BackgroundContent(const BackgroundContent&) = delete;

  /// As RenderFrame::background_content. A frame that others can show again is held until the next
  /// call, so that nobody can have written to it; one that is the caller's alone is not, since it may
  /// be drawn into: 0.
  std::uint64_t number_of(GstBuffer* frame);

  /// Lets go of the frame.
  void reset() { gst_clear_buffer(&held_); }

 private:
  GstBuffer* held_ = nullptr;
  std::uint64_t number_ = 0;
};

}  // namespace polyhull::element
