// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A disk before a screen, and chromamatte to key it.
#pragma once

#include <gst/check/gstharness.h>

#include <numbers>
#include <string>

#include "elements/frames.h"

namespace polyhull::test {

inline constexpr int width = 96;
inline constexpr int height = 64;
inline const Disk subject{40.3, 30.7, 18.0};
inline const double disk_area = std::numbers::pi * 18.0 * 18.0;

/// A harness around chromamatte with the properties of a gst-launch description.
inline GstHarness* harness_for(const std::string& description, const char* format = "RGBx") {
  GstHarness* h = gst_harness_new_parse(description.c_str());
  gst_harness_set_src_caps(h, video_caps(format, width, height));
  return h;
}

inline GstBuffer* pushed(GstHarness* h, const char* format, const Disk& disk,
                         GstClockTime pts = 0) {
  GstCaps* caps = video_caps(format, width, height);
  GstBuffer* out = gst_harness_push_and_pull(h, disk_frame(caps, disk, pts));
  gst_caps_unref(caps);
  return out;
}

}  // namespace polyhull::test
