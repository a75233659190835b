// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How a surface moves when its body does not, and when it walks.
#pragma once

#include <string>
#include <vector>

#include "body_methods.h"
#include "measure.h"

namespace polyhull::benchmark {

/// A row of \p table for each of \p methods with the cameras of \p rig:
/// - noise_mm: how far it is from the surface to itself with other noise, both times Gaussian of
///   half a pixel on the contours' vertices, mean over the bodies; noise_ratio: over the same of
///   the hull;
/// - step_mm: how far it is from one frame of the walking figure to the next, 25 frames a second,
///   mean over a second; step_ratio: over the same of the truth; worst_step: of the single steps,
///   the largest share by which one is longer or shorter than the truth's.
void measure_motion(const std::string& rig, const std::vector<test::Body>& bodies,
                    const std::vector<Method>& methods, Table& table);

/// The table's first line.
inline const char* motion_header() {
  return "rig,method,noise_mm,noise_ratio,step_mm,step_ratio,worst_step";
}

}  // namespace polyhull::benchmark
