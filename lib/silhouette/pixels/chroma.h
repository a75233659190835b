// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Where a frame's chroma lies and how it becomes colour. Internal to the silhouette stage.
#pragma once

#include <cstdint>

#include "silhouette/pixels/frame.h"

namespace polyhull::silhouette {

/// The two rows of chroma samples between which a luma row lies, and their weights (sum 4).
struct ChromaRows {
  int near_row = 0;
  int far_row = 0;
  int near_weight = 4;
  int far_weight = 0;
};

/// Do chroma samples lie half way between two columns?
inline bool between_columns(ChromaSite site) {
  return site == ChromaSite::centre || site == ChromaSite::top;
}

/// For luma row \p y; formats not halved down have one chroma row per luma row.
ChromaRows chroma_rows(const FrameView& frame, int y);

/// Number of chroma samples in a row.
inline int chroma_width(const FrameView& frame) {
  return halved_across(frame) ? (frame.width + 1) / 2 : frame.width;
}

/// Coefficients of R, G, B in levels: channel = luma_gain * (Y - luma_zero) + cb[c] * (Cb - zero) +
/// cr[c] * (Cr - zero), for samples as loaded (of 8 or 10 bits).
struct ColourCoefficients {
  double luma_gain;
  double luma_zero;
  double chroma_zero;
  double cb[3];
  double cr[3];
};

ColourCoefficients colour_coefficients(const FrameView& frame);

}  // namespace polyhull::silhouette
