// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The scene as one view sees it, drawn once per view and only where somebody looks: the depth of
/// every sample of a pixel, and what lies at the pixel's middle.
#pragma once

#include <bit>
#include <memory>
#include <optional>
#include <vector>

#include "base/vector.h"
#include "raster/screen_triangles.h"
#include "raytrace/traced_scene.h"

namespace polyhull::processor {

/// What decides a layer's content, apart from the scene.
struct LayerView {
  Mat4 pixels_from_scene{1.0};  ///< homogeneous: pixels_from_clip() of the clip space, in which the
                                ///< far plane, which follows subjects, does not count
  int width = 0, height = 0;
  int samples = 4;
  std::optional<Vec4> kept;  ///< only the scene on this plane's positive side
  int mirror_mesh = -1;      ///< whose visible samples are marked
  bool operator==(const LayerView&) const = default;
};

class SceneLayer {
 public:
  /// Some rows of the layer; columns left .. right - 1 are drawn. Index (y - top) * width + x, with
  /// one such block per sample in `inverse`.
  struct Band {
    int left = 0, right = 0;
    std::vector<float> inverse;         ///< 1/z by sample, 0: nothing there
    std::vector<float> centre_inverse;  ///< at pixels' middles
    std::vector<std::uint32_t> centre;  ///< what is there: for hit(); no_triangle: nothing
    std::vector<std::uint8_t> mirror;   ///< bit s: sample s shows the mirror
  };

  /// From now on \p view of \p scene (which must stay alive); keeps what is drawn where nothing
  /// changed. Returns whether something did.
  bool set(const TracedScene* scene, const LayerView& view);

  /// Forgets what is drawn, and the view.
  void forget() { scene_ = nullptr, view_ = {}; }

  /// Draws what of \p part is missing. Returns whether anything was.
  bool ensure(const Rectangle& part);

  const Band& band(int number) const { return bands_[static_cast<std::size_t>(number)]; }
  const LayerView& view() const { return view_; }

  /// Whether a sample of any pixel of \p part, which is drawn, shows the view's mirror.
  bool shows_mirror(const Rectangle& part) const;
  /// The share of pixel (x, y)'s samples that do.
  float mirror_at(int x, int y) const {
    const Band& of = bands_[static_cast<std::size_t>(y / band_rows)];
    return static_cast<float>(std::popcount(
               of.mirror[static_cast<std::size_t>(y % band_rows) * view_.width + x])) /
           static_cast<float>(view_.samples);
  }

  /// What lies at the middle of pixel (x, y), which is drawn: its mesh, triangle and place there;
  /// the distance is the depth.
  RayHit hit(int x, int y) const;
  float inverse_at(int x, int y) const {
    return bands_[static_cast<std::size_t>(y / band_rows)]
        .centre_inverse[static_cast<std::size_t>(y % band_rows) * view_.width + x];
  }

 private:
  void draw(int number, int left, int right);

  const TracedScene* scene_ = nullptr;
  LayerView view_;
  ScreenTriangles triangles_;
  std::vector<std::uint32_t> first_of_mesh_;  // ids count through all meshes
  std::uint32_t mirror_first_ = 0, mirror_pieces_ = 0;  // of triangles_: those of the mirror
  std::vector<Band> bands_;
};

}  // namespace polyhull::processor
