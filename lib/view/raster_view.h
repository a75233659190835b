// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The fast picture of a lit scene, rasterised: what render_view() traces, at a third to a quarter of its cost.
///
/// The scene's triangles are drawn with eight samples a pixel, and each is shaded once in every pixel
/// that shows it, at the mean place of its samples there; samples are drawn only where one triangle does
/// not cover all around (covered_blocks.h). Where a planar mirror is seen, the scene
/// is drawn once more as the mirror shows it; what curved mirrors and mirrors in mirrors show is
/// traced by rays. Everything is sampled at fixed places: no noise, no flicker.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "view/pixel_runs.h"
#include "view/scene_on_screen.h"
#include "view/view_rays.h"

namespace polyhull {

class RasterView {
 public:
  /// Both must outlive this; the scene's meshes and mirrors stay, but for where
  /// set_light() and take_pose() put meshes that are no mirrors.
  RasterView(const TracedScene& scene, const LightCache& light);

  /// Draws what \p camera sees into \p picture, as render_view() does. ViewOptions::contrast does
  /// not count; lens distortion and subjects are left out. Statistics: the rays, and as smoothed
  /// the pixels that show several triangles. The result does not depend on the number of threads.
  void draw(const Camera& camera, const ViewOptions& options, std::span<Vec3f> picture,
            ViewStatistics* statistics = nullptr);

  /// The scene's triangles on the screen of the last draw(), as SceneOnScreen::set() makes them of
  /// pixels_from_scene(); null: none was drawn. The next draw() makes others.
  std::shared_ptr<const SceneOnScreen> triangles() const { return triangles_; }

 private:
  struct Pass;
  struct Band;
  static Band& own_band();

  void draw_screen(const Pass& pass);
  void draw_mirror(const Pass& direct, std::size_t number);
  void draw_band(const Pass& pass, Band& band);
  static std::size_t find_stretches(Band& band, int left, int right);
  void draw_tile(const Pass& pass, Band& band, int left, int right);
  void draw_row(const Pass& pass, Band& band, int x, int end, int y);
  void add_sky(const Pass& pass, int x, int y, unsigned samples);
  void shade(const Pass& pass, Band& band, PixelRun& run, int y);
  bool leave(const Pass& pass, Band& band, int mirror, PixelRun& run, int y);
  void send(const Pass& pass, Band& band, int x, int y, unsigned samples);
  void trace(const Pass& pass, Band& band);
  void find_part(const Pass& pass, Band& band) const;
  unsigned wanted(const Pass& pass, std::size_t pixel) const;

  const TracedScene& scene_;
  SpanShader shader_;
  std::shared_ptr<const SceneOnScreen> triangles_;
  SceneOnScreen mirrored_;
  // By pixel: which of its samples show a planar mirror that is drawn, and which mirror that is.
  std::vector<std::uint8_t> mirror_samples_, mirror_;
  std::vector<std::atomic<std::uint32_t>> mirror_pixels_;  // by mirror
  std::atomic<std::uint64_t> rays_ = 0, edges_ = 0;
};

}  // namespace polyhull
