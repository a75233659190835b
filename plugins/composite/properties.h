// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What users can set on composite, and on its mesh pads.
#pragma once

#include <span>
#include <string>

#include "plugins/common/live/live_timing.h"
#include "plugins/common/property_table.h"
#include "render/frame.h"

namespace polyhull::element {

struct CompositeSettings {
  std::string scene;
  double eye_x = 1.15, eye_y = 1.5, eye_z = 2.75;
  double target_x = 0.0, target_y = 0.98, target_z = 0.0;
  double field_of_view = 52.0;
  double exposure = 0.0;
  ShadowQuality shadow = RenderSettings{}.shadow;
  int light_samples = RenderSettings{}.light_samples;
  int shadow_map_size = RenderSettings{}.shadow_map_size;
  MirrorMode mirror = RenderSettings{}.mirror;
  double reflection_alpha = RenderSettings{}.reflection_alpha;
  int edge_samples = RenderSettings{}.edge_samples;
  bool skip = RenderSettings{}.skip;
  bool navigate = true;
  std::uint64_t max_mesh_age = G_MAXUINT64;
  std::uint64_t max_latency = LiveSettings{}.max_latency;

  LiveSettings live() const { return {GST_CLOCK_TIME_NONE, max_latency}; }
};

/// The properties of the viewport's camera, which navigation moves.
inline constexpr const char* camera_properties[] = {
    "eye-x", "eye-y", "eye-z", "target-x", "target-y", "target-z", "field-of-view"};

std::span<const Property<CompositeSettings>> composite_properties();

RenderSettings render_settings(const CompositeSettings& settings);

/// The viewport that the properties describe, y up. Throws Error where eye and target are the same.
Camera viewport_camera(const CompositeSettings& settings, int width, int height);

struct PlacementSettings {
  double translate_x = 0.0, translate_y = 0.0, translate_z = 0.0;
  double rotate_x = 0.0, rotate_y = 0.0, rotate_z = 0.0;
  double scale = 1.0;
};

std::span<const Property<PlacementSettings>> placement_properties();

SubjectPlacement placement(const PlacementSettings& settings);

}  // namespace polyhull::element
