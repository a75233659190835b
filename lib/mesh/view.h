// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The content of one application/x-polyhull-view buffer, in memory: what one camera saw at one
/// instant. wire/view_payload.h turns it into bytes and back.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/rings.h"
#include "base/vector.h"

namespace polyhull {

/// A view or set without a trigger number, or without a time.
inline constexpr std::uint64_t no_trigger = ~std::uint64_t{0};
inline constexpr std::int64_t no_time = INT64_MIN;
/// Capture times lie from 0 to this, the year 2065, so that sums and differences of a few never
/// overflow.
inline constexpr std::int64_t latest_time = 3'000'000'000'000'000'000;

/// Whose clock a capture time is of, and who read it. Times of one clock can be compared, whoever
/// read them: arrival and pipeline are one.
enum class CaptureClock : std::uint8_t {
  arrival,   ///< the pipeline's, read when the frame came: base time + running time
  pipeline,  ///< the pipeline's, of the exposure itself (a driver or a trigger says so)
  unix,      ///< the camera's or driver's, since 1970 UTC
  ptp,       ///< the camera's, set by PTP
};

enum class PixelFormat : std::uint8_t { none, rgba, grey };

/// One camera at one instant.
struct View {
  std::string camera;  ///< its name in the rig
  std::uint64_t trigger = no_trigger;
  std::int64_t capture_time = no_time;         ///< ns, absolute; 0 to latest_time
  CaptureClock clock = CaptureClock::arrival;  ///< of capture_time
  std::int64_t timecode = no_time;             ///< ns since midnight, of the frame's first instant
  int width = 0;                               ///< pixels of the full frame
  int height = 0;                              ///< pixels of the full frame
  Rectangle roi;   ///< the part of the frame that `pixels` covers; empty: no pixels
  Rings contours;  ///< real (distorted) full-frame pixels
  PixelFormat format = PixelFormat::none;
  int stride = 0;  ///< bytes from one row of the region of interest to the next
  std::span<const std::uint8_t> pixels;  ///< borrowed: the caller keeps the memory
};

}  // namespace polyhull
