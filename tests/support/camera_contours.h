// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Cameras and what they saw, as the hull's stage and the refiner take them.
#pragma once

#include <span>
#include <vector>

#include "hull/camera_contours.h"

namespace polyhull::test {

/// \p rings of \p cameras, one each; both must outlive the result.
inline std::vector<CameraContours> camera_contours(std::span<const Camera> cameras,
                                                   std::span<const Rings> rings) {
  std::vector<CameraContours> views;
  for (std::size_t k = 0; k < cameras.size(); ++k) views.push_back({&cameras[k], &rings[k]});
  return views;
}

}  // namespace polyhull::test
