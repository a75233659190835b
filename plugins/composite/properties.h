// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What users can set on composite, and on its mesh pads.
#pragma once

#include <span>
#include <string>

#include "plugins/common/live/live_timing.h"
#include "plugins/common/viewport.h"
#include "render/frame.h"
#include "scene/announcement.h"
#include "scene/viewport_lens.h"

namespace polyhull::element {

/// What draws the pictures.
enum class Backend { automatic, processor, gl };

/// What of a mesh is drawn.
enum class SubjectShape {
  mesh,         ///< its triangles
  image_based,  ///< the intersection of its views' silhouettes
};

/// What is blurred out of focus, or by the viewport's motion.
enum class BlurRange {
  off,      ///< nothing
  subject,  ///< the subjects: the background's picture has its own
  picture,  ///< all
};

/// What of the composite goes out.
enum class CompositeView {
  composite,  ///< the picture
  key,        ///< its alpha, as an opaque grey
};

/// Times in ns.
struct CompositeSettings : ViewportSettings {
  std::string scene;
  std::uint64_t scene_choice = 0;  // how often scene has been set
  double exposure = 0.0;
  Backend backend = Backend::automatic;
  SubjectShape subject = SubjectShape::mesh;
  ShadowQuality shadow = RenderSettings{}.shadow;
  MirrorMode mirror = RenderSettings{}.mirror;
  double reflection_alpha = RenderSettings{}.reflection_alpha;
  int mirror_depth = RenderSettings{}.mirror_depth;
  std::string mirrors = "auto";  // as parse_mirror_choice() takes it
  AlphaCoding alpha = AlphaCoding::straight;
  CompositeView view = CompositeView::composite;
  int edge_samples = RenderSettings{}.edge_samples;
  bool soft_edges = RenderSettings{}.soft_edges;
  BlurRange depth_of_field = BlurRange::off, motion_blur = BlurRange::off;
  double aperture = 0.0, focus_distance = 0.0;  // mm, m; 0: as tracked
  double shutter_angle = 180.0;                 // degrees
  double falloff_a1 = 0.0, falloff_a2 = 0.0, falloff_a3 = 0.0;
  double grain = ViewportLens{}.grain;
  double grain_size = ViewportLens{}.grain_size;
  bool async_readback = false;
  bool skip = RenderSettings{}.skip;
  bool navigate = true;
  std::uint64_t max_mesh_age = G_MAXUINT64;
  std::uint64_t max_latency = LiveSettings{}.max_latency;

  LiveSettings live() const { return {GST_CLOCK_TIME_NONE, max_latency}; }
};

/// One row per property of CompositeSettings that is not the viewport's.
std::span<const Property<CompositeSettings>> composite_properties();

/// What of them the renderer needs.
RenderSettings render_settings(const CompositeSettings& settings);

/// What of them the lens is made of; \p announced is the background's announcement, null: none.
ViewportLens lens_settings(const CompositeSettings& settings, const Announcement* announced);

/// What users can set on a mesh pad: metres and degrees.
struct PlacementSettings {
  double translate_x = 0.0, translate_y = 0.0, translate_z = 0.0;
  double rotate_x = 0.0, rotate_y = 0.0, rotate_z = 0.0;
  double scale = 1.0;
  Pivot pivot = SubjectPlacement{}.pivot;
  double pivot_x = 0.0, pivot_y = 0.0, pivot_z = 0.0;
  SubjectLighting light = SubjectLighting::off;
  double relight = RenderSubject{}.relight;
  bool match = false;
  double exposure = 0.0;  // stops
  double slope_red = 1.0, slope_green = 1.0, slope_blue = 1.0;
  double offset_red = 0.0, offset_green = 0.0, offset_blue = 0.0;
  double power_red = 1.0, power_green = 1.0, power_blue = 1.0;
  double saturation = Grade{}.saturation;
};

/// One row per property of PlacementSettings.
std::span<const Property<PlacementSettings>> placement_properties();

/// The same as the renderer takes it.
SubjectPlacement placement(const PlacementSettings& settings);
Grade grade(const PlacementSettings& settings);
/// Sets the exposure and slopes that make 1 \p white, picture values of which one is above 0.
void set_white(PlacementSettings& settings, const Vec3f& white);

}  // namespace polyhull::element
