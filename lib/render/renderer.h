// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What draws composites: on the processor (processor/processor_renderer.h) or with OpenGL
/// (gl/compositor.h), from one plan, by one shading model. Knows nothing of GStreamer.
///
/// In linear light, per pixel, with L the background's radiance times the exposure:
///   L' = L - (albedo / pi) * E_taken            the light that the subjects block, of all lights
///          - F (albedo_m / pi) * E_taken_m        together, here and, by F, where a mirror looks
///   L" = L' + F * S - min(F * R, L')            F Schlick's Fresnel term of the mirror (of mirrors
///                                               seen in mirrors the product), S the subject's image
///                                               in it, R what it showed there; of metal that is all
///                                               there was, L'
///   out = (1 - a) L" + a C                      C the subject's own picture, a its coverage
/// Over a background that is not opaque this becomes a fill and its key (fill.h).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/bodies/body_trees.h"
#include "render/frame.h"
#include "render/subject_light.h"
#include "render/yuv/yuv_picture.h"

namespace polyhull {

/// Of the latest frame.
struct RenderStatistics {
  struct PassTime {
    const char* name;
    double cpu_milliseconds;
    double gpu_milliseconds;  ///< of a frame shortly before; negative: not known
  };
  std::vector<PassTime> passes;
  std::uint64_t pictures_uploaded = 0;          ///< processor: made ready
  std::uint64_t pictures_skipped = 0;           ///< of views that colour nothing visible
  std::uint64_t bytes_uploaded = 0;             ///< GL only, of all kinds
  std::uint64_t background_bytes_uploaded = 0;  ///< GL only
  std::uint64_t rays = 0;                       ///< processor only
  /// Pixels whose layers are put together, and those of them that come out other than the background.
  /// GL: of pictures read back to memory, those of start() counted with the frame after take();
  /// OpenGL ES does not know the first.
  std::uint64_t pixels_shaded = 0, pixels_changed = 0;
  bool subject_skipped = false;  ///< outside the picture
  bool shadow_skipped = false;
  bool mirror_skipped = false;
  /// Lights whose shadows are drawn, and those whose shadows cannot be seen (shadow_lights.h).
  std::uint64_t shadow_lights = 0, lights_skipped = 0;
  /// Mirrors in which subjects are drawn, one seen in another counts too; and those of the scene in
  /// which nobody is seen.
  std::uint64_t mirrors = 0, mirrors_skipped = 0;
  bool scene_depth_reused = false;
  bool scene_planes_taken = false;    ///< RenderFrame::planes, for a view that is new
  bool static_shadow_reused = false;  ///< what the scene itself hides from the light
  bool mesh_reused = false;           ///< what was made ready of it before is used again

  /// What \p plan says of subject, shadows and mirrors.
  void take(const RenderPlan& plan);

  /// Adds those of a frame's next part, of a composite that is drawn in parts (lens/lens_picture.h):
  /// times and counts are added up, skipped is what none of them has drawn, and of the scene holds
  /// what the first part says.
  void add(const RenderStatistics& part);
};

/// Draws frame after frame, and keeps what stays. Not for use by two threads at once.
class Renderer {
 public:
  Renderer();
  virtual ~Renderer();

  /// What \p frame needs; where RenderPlan::untouched() the background is the result and no
  /// render() is needed. Throws Error as plan_frame().
  RenderPlan plan(const RenderFrame& frame, const RenderSettings& settings);

  /// The picture value of a white surface in the light where \p subject, of plan() of \p frame, stands, on
  /// average over all orientations and the subject's points: what it has to be multiplied by besides
  /// its lighting for a white that the studio shows as 1. nullopt: nothing there is lit. Throws Error
  /// as plan().
  std::optional<Vec3f> white(const RenderFrame& frame, const PlacedSubject& subject);

  /// Reads \p background and writes the changed part of \p target, both RGBA rows of at least 4 *
  /// width bytes, \p background_stride and \p target_stride bytes apart (multiples of 4). They may
  /// be the same memory; where they are not, \p target holds the background already. Throws Error
  /// where OpenGL refuses, or Embree has too little memory.
  virtual void render(const RenderFrame& frame, const RenderPlan& plan,
                      const RenderSettings& settings, const std::uint8_t* background,
                      int background_stride, std::uint8_t* target, int target_stride) = 0;

  /// As render(), but the changed part is written as video, without alpha: the background's is
  /// ignored (AlphaCoding). \p target, which is no memory of the
  /// background, holds that already as write_yuv() makes it.
  virtual void render_yuv(const RenderFrame& frame, const RenderPlan& plan,
                          const RenderSettings& settings, const std::uint8_t* background,
                          int background_stride, const YuvPicture& target);

  const RenderStatistics& statistics() const { return statistics_; }

  /// "OpenGL ES 3.2 Mesa ... (llvmpipe ...)" or "the processor, with avx2", for messages.
  virtual std::string description() const = 0;

 protected:
  /// Whether it draws the shadows of soft lights in one (RenderPlan::soft_lights).
  virtual bool joins_soft_lights() const { return false; }

  /// The scene of \p frame ready for rays: RenderFrame::traced, or made when it is first asked for;
  /// null where it has no geometry. Throws Error as TracedScene.
  const TracedScene* traced(const RenderFrame& frame);

  RenderStatistics statistics_;

 private:
  Bounds scene_bounds_;
  std::shared_ptr<const Scene> bounds_held_, traced_held_;
  std::shared_ptr<const TracedScene> traced_;
  SubjectLight subject_light_;
  BodyTrees bodies_;                 // by subject
  std::vector<std::uint8_t> drawn_;  // what render_yuv() converts
};

}  // namespace polyhull
