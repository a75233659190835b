// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// One composite to be made, and what of it needs drawing.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "imagehull/image_subject.h"
#include "mesh/mesh.h"
#include "render/grade.h"
#include "render/projection.h"
#include "render/seen_mirrors.h"
#include "render/shadow_lights.h"
#include "scene/scene.h"

namespace polyhull {

struct DepthPicture;     // depth_picture.h
struct EnvironmentPart;  // environment/environment.h
struct LightLattice;     // light_lattice.h
struct ScenePlanes;      // view/scene_planes.h
class TracedScene;       // raytrace/traced_scene.h

/// How exactly the subjects' shadows of the scene's lights are drawn: shadow_recipe.h. hard is of the
/// lights' middles alone.
enum class ShadowQuality { off, hard, fast, good, best };

/// How the subjects' images are drawn in the scene's planar mirrors.
enum class MirrorMode {
  off,
  fresnel,  ///< by the material: the subject takes the place of what the mirror showed
  plain,    ///< mixed in with a constant share, as in the prototype
};

/// The light that subjects are seen in.
enum class SubjectLighting {
  off,  ///< the studio's, as their pictures have it
  shade,  ///< the studio's, times the scene's where they are relative to the stage's (subject_light.h)
  relit,  ///< shade, times what of it each part of the body gets by the way it faces (light_lattice.h)
};

/// What the colours beside an alpha below 1 are, of backgrounds and of composites alike (fill.h).
enum class AlphaCoding {
  ignored,        ///< alpha says nothing of a background: all of it counts as opaque
  straight,       ///< those of the covered part, as in GStreamer's video/x-raw
  premultiplied,  ///< those times alpha
};

/// How composites are drawn.
struct RenderSettings {
  ShadowQuality shadow = ShadowQuality::good;
  int light_samples = 16;     ///< GL only: cells of an area light, 1, 4, 9 or 16; of best always 16
  int shadow_map_size = 256;  ///< GL only: texels per side, 16 to 4096; of a hard shadow 8 times
  MirrorMode mirror = MirrorMode::fresnel;
  float reflection_alpha = 0.3f;  ///< of MirrorMode::plain, 0..1
  /// By way of how many mirrors, one seen in the other, subjects are seen; 1 to 4.
  int mirror_depth = 1;
  /// Samples per pixel at the subject's edges, 0 and 1: hard edges; the processor takes up to 8.
  int edge_samples = 4;
  AlphaCoding alpha = AlphaCoding::ignored;
  bool soft_edges = false;  ///< outlines as soft as the mattes (subject/soft_edge.h), not polygons
  bool skip = true;         ///< leave out what changes nothing; the picture is the same to the bit
  bool operator==(const RenderSettings&) const = default;
};

/// A mesh to be drawn and where.
struct RenderSubject {
  const Mesh* mesh = nullptr;
  SubjectPlacement placement;
  std::uint64_t content = 0;  ///< the same number: the same mesh as before; 0: not known
  /// Drawn from its silhouettes instead of the mesh's triangles, by the processor's renderer alone;
  /// of the same content. Null: by triangles.
  std::shared_ptr<const ImageSubject> image;
  SubjectLighting lighting = SubjectLighting::off;
  float relight = 0.5f;  ///< of SubjectLighting::relit: from 0, as shade, to 1
  Grade grade;           ///< of its colours in that light
};

inline constexpr std::size_t max_soft_parts = 1024;

/// What is to be drawn.
struct RenderFrame {
  int width = 0;  ///< of the picture
  int height = 0;
  Camera viewport;  ///< scene coordinates; resized to the picture; its lens distortion is ignored
  std::shared_ptr<const Scene> scene;  ///< null: no geometry, no shadow, no mirror
  /// The same ready for rays, where somebody has made it; null: renderers make their own.
  std::shared_ptr<const TracedScene> traced;
  /// The scene's as they are now, and after them environment_lights() times `sky`.
  std::vector<Light> lights;
  /// Environment::soft_parts() of the same environment and number of lights, at most max_soft_parts, which
  /// give what those of `lights` that are soft do where `sky` is 1: renderers may draw the shadow of these
  /// instead, all in one. Null: none.
  std::shared_ptr<const std::vector<EnvironmentPart>> soft_light;
  /// By Scene::mirrors: which are to show nobody; none: all may show somebody.
  std::vector<bool> mirrors_left_out;
  /// The same and the sky as bright as the scene's file has them: Announcement::undimmed.
  std::vector<Light> undimmed;
  std::optional<Vec3f> undimmed_sky;
  float exposure = 1.0f;  ///< as Scene::exposure
  Vec3f ambient{0.0f};    ///< as Announcement::ambient
  Vec3f sky{0.0f};        ///< as Announcement::sky
  std::vector<RenderSubject> subjects;
  /// Where the background's drawing has them ready, the scene's triangles on the screen. Taken by the
  /// processor's renderer where they are of this view of this scene; the picture is the same to the
  /// bit. Null: none.
  std::shared_ptr<const ScenePlanes> planes;
  /// What the background shows beyond the scene's geometry, or without any: hides subjects, too.
  /// Null: none.
  std::shared_ptr<const DepthPicture> depth;
  /// The same number: the background's pixels in memory are those of the frames before that had it;
  /// 0: not known.
  std::uint64_t background_content = 0;
};

/// A subject in scene coordinates.
struct PlacedSubject {
  const Mesh* mesh = nullptr;  ///< of an image-based subject ImageSubject::mesh
  Mat4 to_scene{1.0};          ///< from the mesh's world
  Mat4 local_to_scene{1.0};    ///< from coordinates relative to Hull::origin
  Mat4 from_scene{1.0};        ///< to the mesh's world
  /// The hull's vertices in scene coordinates; of an image-based subject the corners around it.
  std::vector<Vec3f> points;
  Bounds bounds;                              ///< of these
  std::shared_ptr<const ImageSubject> image;  ///< as RenderSubject::image
  std::uint64_t content = 0;                  ///< as RenderSubject::content
  SubjectLighting lighting = SubjectLighting::off;
  float relight = 0.5f;  ///< as RenderSubject::relight
  Grade grade;           ///< as RenderSubject::grade
  /// Of a shaded or relit subject in a scene with light, else null; plan_frame() leaves it to
  /// Renderer::plan().
  std::shared_ptr<const LightLattice> shade;
  /// Of a relit one, by vertex of the mesh: by what its colours are multiplied besides; else empty.
  std::vector<Vec3f> form;
  int beyond = 0;  ///< pixels that its soft edge reaches beyond its hull
};

/// What has to be drawn where. Rectangles are empty for what changes no pixel.
struct RenderPlan {
  Mat4 clip_from_scene{1.0};
  Vec3 eye{0.0};                        ///< the viewport's centre, scene coordinates
  double pixel_size = 0.0;              ///< of the viewport at depth 1
  std::vector<PlacedSubject> subjects;  ///< those that are not empty
  int unusable = 0;                     ///< those left out: not finite, or beyond 1e9 m
  Rectangle subject, shadow;
  std::vector<SeenMirror> mirrors;  ///< each after the one that shows it
  std::size_t mirrors_skipped = 0;  ///< of Scene::mirrors: nobody is seen in them, or is to be
  std::vector<ShadowLight>
      lights;  ///< those whose shadows are drawn; `shadow` and so on bound theirs
  /// How many of the lights that throw shadows are drawn as RenderFrame::soft_light, and not among `lights`.
  std::size_t soft_lights = 0;
  /// The lights that subjects can block, whether their shadows are in the picture or not: of all these
  /// together the renderers keep what is taken as a share.
  std::vector<std::size_t> blocked_lights;
  std::size_t lights_skipped =
      0;  ///< the rest of RenderFrame::lights: their shadows cannot be seen
  /// Where any mirror may show the subjects, and where their shadow.
  Rectangle mirror() const;
  Rectangle mirror_shadow() const;
  Rectangle changed() const {
    return bounding(bounding(subject, shadow), bounding(mirror(), mirror_shadow()));
  }
  bool untouched() const { return changed().empty(); }
};

/// Who looks at \p subject, in its mesh's world coordinates: the viewport's eye, and its images behind
/// the mirrors in which subjects may be seen (SeenMirror::sight).
std::vector<Vec3> eyes_on(const PlacedSubject& subject, const RenderPlan& plan);

/// All subjects of \p plan that have triangles as one shape: corners in scene coordinates, three to a
/// triangle.
struct SubjectsShape {
  std::vector<Vec3f> points;
  std::vector<std::uint32_t> triangles;
};
SubjectsShape shape_of(const RenderPlan& plan);

/// How many units of the scene a unit of \p subject's mesh is.
double scale_of(const PlacedSubject& subject);

/// Whether the frame has soft lights whose shadows can be drawn in one, as RenderFrame::soft_light: not hard
/// ones, nor those of image-based subjects.
bool can_join_soft_lights(const RenderFrame& frame, const RenderSettings& settings);

/// Finds what a frame needs. \p scene_bounds are those of the scene's geometry. \p join: soft lights are
/// taken together (RenderPlan::soft_lights) where can_join_soft_lights() and the frame has
/// RenderFrame::soft_light; their shadow may be wherever the scene is. Throws Error when
/// the viewport camera is not finite or degenerate, and for lights that are not finite or beyond
/// 1e9 m.
RenderPlan plan_frame(const RenderFrame& frame, const RenderSettings& settings,
                      const Bounds& scene_bounds, bool join = false);

}  // namespace polyhull
