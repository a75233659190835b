// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Any bytes as a matte and settings for tracing and approximating it, and everything that is
/// promised of what comes out.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "silhouette/blur/blur.h"
#include "silhouette/contour/approximate.h"
#include "silhouette/contour/trace.h"

namespace polyhull::test {

struct MaskTrial {
  int width = 1, height = 1;
  std::vector<std::uint8_t> levels;
  BlurSettings blur;
  TraceSettings trace;
  ApproximateSettings approximate;

  /// For messages.
  std::string describe() const;
};

/// Reads sizes up to 48x40, one of several kinds of picture (single pixels, levels, overlaid
/// rectangles, lines, disks), the blur and the settings; what the bytes do not say is 0.
MaskTrial mask_from_bytes(std::span<const std::uint8_t> bytes);

/// What is wrong with the rings of the trial, empty when nothing is:
///  - traced: closed, simple, disjoint, nested by orientation; each pixel centre on its side; the
///  area
///    that of marching squares in double precision; parents the smallest rings around;
///  - approximated: simple, disjoint, nested; not farther than the tolerance from what was traced,
///  and,
///    where nothing was dropped, what was traced not farther from them; same bytes the second time.
std::string fault_of(const MaskTrial& trial);

}  // namespace polyhull::test
