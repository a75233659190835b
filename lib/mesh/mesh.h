// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The content of one application/x-polyhull-mesh buffer, in memory: the hull of one instant with
/// its views. wire/mesh_payload.h turns it into bytes and back.
#pragma once

#include <optional>
#include <vector>

#include "hull/hull.h"
#include "mesh/view.h"
#include "rig/camera.h"
#include "texture/texturing.h"

namespace polyhull {

/// A view inside a mesh: with the calibration it was used with.
struct MeshView {
  Camera calibration;
  View view;
};

/// One instant: the hull, its views, and after hulltexture the texturing.
struct Mesh {
  std::uint64_t trigger = no_trigger;
  std::int64_t capture_time = no_time;  ///< of the set: its earliest view's, ns
  Vec3 up{0.0, 1.0, 0.0};               ///< the rig's up direction, for placing in a scene
  double metres_per_unit = 1.0;         ///< of the rig's world
  float opacity = 1.0f;                 ///< of the subject as it is to be shown, 0..1: it fades out
  Hull hull;
  std::vector<MeshView> views;  ///< HullFace::view and Texturing index these
  std::optional<Texturing> texturing;
};

}  // namespace polyhull
