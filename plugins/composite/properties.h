// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What users can set on composite, and on its mesh pads.
#pragma once

#include <span>
#include <string>

#include "plugins/common/live/live_timing.h"
#include "plugins/common/property_table.h"
#include "render/frame.h"
#include "scene/viewport_control.h"

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

  ViewportPose pose() const { return {{eye_x, eye_y, eye_z}, {target_x, target_y, target_z}}; }
  void set_pose(const ViewportPose& pose) {
    eye_x = pose.eye.x, eye_y = pose.eye.y, eye_z = pose.eye.z;
    target_x = pose.target.x, target_y = pose.target.y, target_z = pose.target.z;
  }
  LiveSettings live() const { return {GST_CLOCK_TIME_NONE, max_latency}; }
};

/// The properties that navigation moves.
inline constexpr const char* camera_properties[] = {"eye-x",    "eye-y",    "eye-z",
                                                    "target-x", "target-y", "target-z"};

std::span<const Property<CompositeSettings>> composite_properties();

RenderSettings render_settings(const CompositeSettings& settings);

struct PlacementSettings {
  double translate_x = 0.0, translate_y = 0.0, translate_z = 0.0;
  double rotate_x = 0.0, rotate_y = 0.0, rotate_z = 0.0;
  double scale = 1.0;
};

std::span<const Property<PlacementSettings>> placement_properties();

SubjectPlacement placement(const PlacementSettings& settings);

}  // namespace polyhull::element
