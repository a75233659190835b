// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// One camera's contours, as it saw them.
#pragma once

#include "base/rings.h"
#include "rig/camera.h"

namespace polyhull {

/// What one camera saw: contours in real (distorted) pixels.
struct CameraContours {
  const Camera* camera = nullptr;
  const Rings* rings = nullptr;
};

}  // namespace polyhull
