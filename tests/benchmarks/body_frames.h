// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From a body's contours and pictures to a drawn frame, and how far that is from the truth half way
/// between the cameras.
#pragma once

#include "render/processor/processor_renderer.h"
#include "support/body_scenes.h"

namespace polyhull::benchmark {

/// A body and its views, with contours of a case's tolerance, and pixels of their boxes alone.
struct Take {
  test::BodyScene scene;
  Mesh views;
  std::size_t vertices = 0;  ///< of all contours

  Take(test::BodyScene from, double tolerance);
};

/// \p subject from \p viewport, edges of \p samples samples, on a picture of which every byte is
/// \p before.
Picture drawn(ProcessorRenderer& renderer, const RenderSubject& subject, const Camera& viewport,
              int width, int height, int samples, std::uint8_t before);

/// What is behind the bodies of body_scenes.h.
inline constexpr std::uint8_t behind_bodies = 24;

/// Sums over the views half way between cameras.
struct BetweenError {
  double overlap = 0.0;  ///< IoU of half coverage
  double psnr = 0.0;     ///< dB where either is
  double views = 0.0;
};
void add_error(const Take& take, const RenderSubject& subject, BetweenError& sum);

/// The subject that is the textured \p mesh, by viewing angle.
RenderSubject textured_subject(Mesh& mesh);

}  // namespace polyhull::benchmark
