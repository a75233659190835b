// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Composites drawn with OpenGL 3.3 core or OpenGL ES 3.0 (with colour-renderable half floats): the
/// caller has a context current. Without OpenGL see processor/processor_renderer.h.
///
/// The shadow: the light blocked is summed over cells of the light, each with a depth map of the
/// subjects and one of the scene, so what the scene already shades is not darkened twice. Receivers
/// are the scene's own surfaces and the casters are the subjects alone, so no depth bias is needed
/// between them: a sole on the floor shades it without leak or gap.
#pragma once

#include <memory>
#include <string>

#include "render/renderer.h"

namespace polyhull {

namespace gl {
class PixelQuery;
}

class Compositor : public Renderer {
 public:
  /// Needs a current context, GL 3.3 or GLES 3.0. Throws Error (unsupported) otherwise.
  Compositor();
  ~Compositor() override;

  /// Draws into the RGBA8 texture \p target of the frame's size, all of it; \p background another
  /// such texture. Throws Error where OpenGL refuses, has too little memory, or loses the context.
  void render(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
              unsigned background, unsigned target);

  void render(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
              const std::uint8_t* background, int background_stride, std::uint8_t* target,
              int target_stride) override;
  /// Starts what render() does in memory, and returns once the commands are given: the place to
  /// take() the picture from, until the second start() after this one. \p background may be written
  /// to at once. Throws Error as render().
  unsigned start(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
                 const std::uint8_t* background, int background_stride);

  /// Waits until the picture at \p place is drawn and writes its changed part to \p target, which
  /// holds the background, in rows \p target_stride bytes apart. Throws Error where OpenGL fails.
  void take(unsigned place, std::uint8_t* target, int target_stride);

  std::string description() const override;

  /// For when the context is gone: lets go of everything without calling OpenGL. Only the destructor
  /// may follow.
  void abandon();

  /// Waits after each pass until it is drawn, for benchmarks: RenderStatistics::PassTime's
  /// processor time is then the whole of the pass alone. Frames take longer for it.
  void wait_for_passes(bool wait);

 private:
  struct State;
  void draw(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
            const std::uint8_t* background, int background_stride, gl::PixelQuery& blended);
  std::unique_ptr<State> state_;
};

}  // namespace polyhull
