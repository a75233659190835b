// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Puts subjects into a picture of a scene with OpenGL 3.3 core or OpenGL ES 3.0 (with
/// colour-renderable half floats). Knows nothing of GStreamer: the caller has a context current.
///
/// In linear light, per pixel, with L the background's radiance times the exposure:
///   L' = L - (albedo / pi) * E_taken            the main light that the subjects block
///   L" = L' + F * (S - R)                       F Schlick's Fresnel term of the mirror, S the
///                                               subject's image in it, R what it showed there
///   out = (1 - a) L" + a C                      C the subject's own picture, a its coverage
/// The light blocked is summed over cells of the light, each with a depth map of the subjects and
/// one of the scene, so what the scene already shades is not darkened twice. Receivers are the
/// scene's own surfaces and the casters are the subjects alone, so no depth bias is needed between
/// them: a sole on the floor shades it without leak or gap.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "render/frame.h"

namespace polyhull {

/// Of the latest frame.
struct RenderStatistics {
  struct PassTime {
    const char* name;
    double cpu_milliseconds;
    double gpu_milliseconds;  ///< of a frame shortly before; negative: not known
  };
  std::vector<PassTime> passes;
  std::uint64_t pictures_uploaded = 0;
  std::uint64_t pictures_skipped = 0;  ///< of views that colour nothing visible
  std::uint64_t bytes_uploaded = 0;
  bool subject_skipped = false;  ///< outside the picture
  bool shadow_skipped = false;
  bool mirror_skipped = false;
  bool scene_depth_reused = false;
  bool static_shadow_reused = false;
  bool mesh_reused = false;  ///< already on the graphics processor
};

class Compositor {
 public:
  /// Needs a current context, GL 3.3 or GLES 3.0. Throws Error (unsupported) otherwise.
  Compositor();
  ~Compositor();

  /// What \p frame needs; where RenderPlan::untouched() the background is the result and no
  /// render() is needed. Needs no context.
  RenderPlan plan(const RenderFrame& frame, const RenderSettings& settings);

  /// Draws into the RGBA8 texture \p target of the frame's size; \p background another such
  /// texture.
  void render(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
              unsigned background, unsigned target);

  /// Reads \p background and writes the changed part of \p target, both RGBA rows of at least 4 *
  /// width bytes, \p stride bytes apart (a multiple of 4). They may be the same memory; where they
  /// are not, \p target holds the background already.
  void render(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
              const std::uint8_t* background, int background_stride, std::uint8_t* target,
              int target_stride);

  const RenderStatistics& statistics() const;

  /// "OpenGL ES 3.2 Mesa ... (llvmpipe ...)", for messages.
  std::string description() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace polyhull
