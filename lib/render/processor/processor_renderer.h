// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Composites drawn by the processor, without OpenGL: the subject rasterised with several samples a
/// pixel against the scene's depth, the lights' shadows by rays to their points, the
/// mirror's image like the subject itself. Bands of rows are drawn side by side on the pool's
/// threads; the picture does not depend on how many there are.
#pragma once

#include <memory>

#include "render/renderer.h"

namespace polyhull {

namespace processor {
struct PictureTarget;
}

class ProcessorRenderer : public Renderer {
 public:
  ProcessorRenderer();
  ~ProcessorRenderer() override;

  void render(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
              const std::uint8_t* background, int background_stride, std::uint8_t* target,
              int target_stride) override;
  void render_yuv(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
                  const std::uint8_t* background, int background_stride,
                  const YuvPicture& target) override;
  std::string description() const override;

 protected:
  bool joins_soft_lights() const override { return true; }

 private:
  struct State;
  void draw(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
            const std::uint8_t* background, int background_stride,
            const processor::PictureTarget& target);
  std::unique_ptr<State> state_;
};

}  // namespace polyhull
