// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A figure, or several farther apart than their arms reach, in the small room, photographed by four cameras: all that a composite and its truth
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
  /// The background with the figure in it, by rays; by way of \p mirrors at most.
  Picture truth(int light_side = 8, int pixel_side = 2, int mirrors = 3) const;
  /// Renders the frame over the background.
  Picture composite(Renderer& renderer, const RenderSettings& settings) const;

 private:
  bool polished_;
};

/// The irradiance of a light, per radiance.
struct LightAt {
  float whole = 0.0f;  ///< where nothing is between
  float taken = 0.0f;  ///< what of it the figure blocks, and the scene does not
};

/// That of \p light at \p at, by \p side x \p side rays.
LightAt light_at(const Light& light, const TracedScene& scene, const RayCaster& figure,
                 const Surface& at, int side);

/// So many lamps for the small room: its \p own and, of other colours and kinds, some all over its
/// ceiling, of a quarter of its size and twice its radiance at most.
std::vector<Light> ceiling_lamps(const Light& own, int count);

/// The figure's shadow where no part of the figure is seen.
struct ShadowTruth {
  struct Place {
    int x = 0, y = 0;   ///< pixel
    Vec3f light{0.0f};  ///< irradiance of the lamps where nothing is between
    /// The share of what the surface there scatters of it, all channels together, that the figure blocks,
    /// and the scene does not.
    float taken = 0.0f;
    int material = 0;
  };
  std::vector<Place> places;  ///< at every \p stride-th pixel of every stride-th row

  ShadowTruth(const FigureStage& stage, int side, int stride);
};

}  // namespace polyhull::synthetic
