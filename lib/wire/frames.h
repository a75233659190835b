// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The content of one application/x-polyhull-view and one application/x-polyhull-mesh buffer, in
/// memory. view_payload.h and mesh_payload.h turn them into bytes and back.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/vector.h"
#include "hull/hull.h"
#include "rig/camera.h"
#include "rig/rig.h"
#include "silhouette/rings.h"
#include "texture/texturing.h"

namespace polyhull {

inline constexpr std::uint64_t no_trigger = ~std::uint64_t{0};
inline constexpr std::int64_t no_time = INT64_MIN;

enum class PixelFormat : std::uint8_t { none, rgba, grey };

/// One camera at one instant.
struct View {
  std::string camera;
  std::uint64_t trigger = no_trigger;
  std::int64_t capture_time = no_time;  ///< ns, absolute (the pipeline clock's)
  int width = 0;                        ///< full frame
  int height = 0;
  Rectangle roi;   ///< the part of the frame that `pixels` covers; empty: no pixels
  Rings contours;  ///< real (distorted) full-frame pixels
  PixelFormat format = PixelFormat::none;
  int stride = 0;  ///< bytes from one row of the region of interest to the next
  std::span<const std::uint8_t> pixels;  ///< borrowed: the caller keeps the memory
};

/// A view inside a mesh: with the calibration it was used with.
struct MeshView {
  Camera calibration;
  View view;
};

/// One instant: the hull, its views, and after hulltexture the texturing.
struct Mesh {
  std::uint64_t trigger = no_trigger;
  std::int64_t capture_time = no_time;  ///< of the set: its earliest view
  Vec3 up{0.0, 1.0, 0.0};               ///< from the rig, for placing in a scene
  double metres_per_unit = 1.0;
  Hull hull;
  std::vector<MeshView> views;  ///< HullFace::view and Texturing index these
  std::optional<Texturing> texturing;
};

}  // namespace polyhull
