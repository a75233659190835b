// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From the hull towards the smallest surface that every contact ray still touches: blurring f
/// moves the surface by its mean curvature (a Gaussian blur of variance s^2 moves it by s^2 H to
/// first order; Merriman, Bence and Osher 1992), and at the rims it is put back.
#pragma once

#include <vector>

#include "refine/field/contact_rays.h"

namespace polyhull::refine {

/// The memory that flows work with.
struct FlowMemory {
  std::vector<float> along_x, along_y;         ///< of a blur
  std::vector<float> gaps, weights;            ///< of a correction
  std::vector<Extent> held;                    ///< which of a row's nodes rims touch
  std::vector<Extent> rows_x, rows_y, rows_z;  ///< and which a blur reaches, axis by axis
};

/// Blurs \p values by a Gaussian of \p sigma; its kernel ends at 2.4 sigma and six cells.
/// Beyond the grid values go on as at its border.
void blur(const Grid& grid, std::vector<float>& values, float sigma, FlowMemory& memory,
          int threads);

/// How rims pull at the surface.
struct Pull {
  float sigma = 1.25f;   ///< of the Gaussian around a rim within which it pulls
  float target = 0.04f;  ///< f that rims are to have
  std::size_t stride = 1;
};

/// f + c for a smooth c that is target - f at the rims of \p part, each as found last: gaps are
/// spread over the nodes of a coarser grid, blurred, and divided by their weights blurred as well
/// (normalised convolution, Knutsson and Westin 1993). f stays less than half a cell above H.
void pull_to_rims(Level& level, const ContactRays& rays, std::uint32_t part, const Pull& pull,
                  FlowMemory& memory, int threads);

}  // namespace polyhull::refine
