// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A figure in the small room, photographed by four cameras: all that a composite and its truth
/// need.
#pragma once

#include <memory>
#include <vector>

#include "base/picture.h"
#include "raytrace/traced_scene.h"
#include "render/renderer.h"
#include "synthetic.h"

namespace polyhull::synthetic {

struct FigureStage {
  std::shared_ptr<const Scene> scene;
  Photographed subject;
  RenderFrame frame;
  Picture background;

  explicit FigureStage(int width = 640, int height = 360, bool polished = true);
  FigureStage(const FigureStage&) = delete;
  FigureStage& operator=(const FigureStage&) = delete;

  /// The background by rays: light_side^2 to the lamp, pixel_side^2 in a pixel.
  void trace_background(int light_side = 8, int pixel_side = 2);
  /// An even background of one sRGB value.
  void fill_background(std::uint8_t value);
  /// The background with the figure in it, by rays.
  Picture truth(int light_side = 8, int pixel_side = 2) const;
  /// Renders the frame over the background.
  Picture composite(Renderer& renderer, const RenderSettings& settings) const;

 private:
  bool polished_;
};

/// The share of \p light's irradiance at \p at, by \p side x \p side rays, that
/// \p figure blocks and \p scene does not; negative: none of it falls there.
float shadow_share(const Light& light, const TracedScene& scene, const RayCaster& figure,
                   const Surface& at, int side);

/// The figure's shadow where no part of the figure is seen.
struct ShadowTruth {
  struct Place {
    int x = 0, y = 0;    ///< pixel
    float whole = 0.0f;  ///< irradiance of the lamp alone, per radiance
    float taken = 0.0f;  ///< the share of its light that the figure blocks, and the scene does not
    int material = 0;
  };
  std::vector<Place> places;  ///< at every \p stride-th pixel of every stride-th row

  ShadowTruth(const FigureStage& stage, int side, int stride);
};

}  // namespace polyhull::synthetic
