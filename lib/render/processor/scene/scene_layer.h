// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The scene as one view sees it, drawn once per view and only where somebody looks: what lies at pixels'
/// middles where light may be taken, and the depth of every sample of a pixel where subjects are.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/vector.h"
#include "raytrace/traced_scene.h"
#include "view/scene_on_screen.h"

namespace polyhull::processor {

/// What decides a layer's content, apart from the scene.
struct LayerView {
  Mat4 pixels_from_scene{1.0};  ///< homogeneous, as of pixels_from_scene()
  int width = 0, height = 0;
  int samples = 4;
  std::optional<Vec4> kept;  ///< only the scene on this plane's positive side
  bool mirrors = false;      ///< whether it is known which mirror each sample shows
  bool operator==(const LayerView&) const = default;
};

class SceneLayer {
 public:
  /// From now on \p view of \p scene (which must stay alive); keeps what is drawn where nothing
  /// changed. Returns whether something did. \p ready, where it is given: the triangles of this
  /// scene on this view's screen as SceneOnScreen::set() brings them there, which else is done here.
  bool set(const TracedScene* scene, const LayerView& view,
           std::shared_ptr<const SceneOnScreen> ready = nullptr);

  /// Another number than before when set() has found something changed.
  std::uint64_t generation() const { return generation_; }

  /// Forgets what is drawn, and the view.
  void forget() { scene_ = nullptr, view_ = {}; }

  /// Draws what of the samples in \p parts is missing. Returns whether anything was.
  bool ensure_samples(std::span<const Rectangle> parts);

  /// Draws what of the pixels' middles in \p part is missing. Returns whether anything was.
  bool ensure_middles(const Rectangle& part);

  const LayerView& view() const { return view_; }

  /// 1/z of sample \p s of pixel (x, y) and of those to its right, 0 where nothing is; as far as the
  /// samples are drawn.
  const float* inverse(int s, int x, int y) const {
    const Samples& of = samples_[static_cast<std::size_t>(y / band_rows)];
    return &of.inverse[static_cast<std::size_t>(s) * of.rows * of.width() + of.at(x, y)];
  }

  /// Which of Scene::mirrors sample \p s of pixel (x, y), and of those to its right, shows, counted
  /// from 1; 0: none.
  const std::uint8_t* mirror(int s, int x, int y) const {
    const Samples& of = samples_[static_cast<std::size_t>(y / band_rows)];
    return &of.mirror[static_cast<std::size_t>(s) * of.rows * of.width() + of.at(x, y)];
  }

  /// How many samples of pixel (x, y) show mirror \p number, as mirror() counts them.
  int samples_of_mirror(std::uint8_t number, int x, int y) const {
    const Samples& of = samples_[static_cast<std::size_t>(y / band_rows)];
    const std::uint8_t* at = &of.mirror[of.at(x, y)];
    int count = 0;
    for (int s = 0; s < view_.samples; ++s, at += of.rows * of.width()) count += *at == number;
    return count;
  }

  /// 1/z at the middle of pixel (x, y) and of those to its right, 0 where nothing is; as far as
  /// the middles are drawn.
  const float* middle_inverse(int x, int y) const {
    const Middles& of = middles_[static_cast<std::size_t>(y / band_rows)];
    return &of.inverse[of.at(x, y)];
  }

  /// The piece() there; no_triangle: none.
  const std::uint32_t* middle_piece(int x, int y) const {
    const Middles& of = middles_[static_cast<std::size_t>(y / band_rows)];
    return &of.piece[of.at(x, y)];
  }

  /// A triangle on the screen; its id counts through the triangles of all meshes.
  const ScreenTriangle& piece(std::uint32_t number) const { return screen_->piece(number); }

  /// A triangle of the scene, by its mesh and where its corners' numbers lie there.
  struct Triangle {
    std::uint32_t mesh, number;
    const SceneMesh* of;
    const std::uint32_t* corner;
  };
  Triangle triangle(const ScreenTriangle& piece) const;

  /// What lies at the middle of pixel (x, y), which is drawn: its mesh, triangle and place there;
  /// the distance is the depth.
  RayHit hit(int x, int y) const;

 private:
  /// What is drawn of some rows of the picture: columns left .. right - 1.
  struct Part {
    int left = 0, right = 0;
    std::size_t rows = 0;
    std::size_t width() const { return static_cast<std::size_t>(right - left); }
    std::size_t at(int x, int y) const {
      return static_cast<std::size_t>(y % band_rows) * width() + static_cast<std::size_t>(x - left);
    }
    bool holds(int from, int to) const { return from >= left && to <= right; }
  };
  /// By sample, row and column.
  struct Samples : Part {
    std::vector<float> inverse;
    std::vector<std::uint8_t> mirror;
  };
  struct Middles : Part {
    std::vector<float> inverse;
    std::vector<std::uint32_t> piece;
  };

  void number_triangles();
  void lay_out(Part& part, int number, int left, int right) const;
  void draw_samples(int number, int left, int right);
  void mark(const std::uint32_t* pieces, std::size_t count, std::uint8_t* mirrors) const;
  void draw_middles(int number, int left, int right);

  const TracedScene* scene_ = nullptr;
  LayerView view_;
  std::uint64_t generation_ = 0;
  std::shared_ptr<const SceneOnScreen> screen_;
  std::vector<std::uint32_t> first_of_mesh_;  // ids count through all meshes; and the end
  std::vector<std::uint32_t> mesh_of_;        // by id
  std::vector<std::uint8_t> mirror_of_;       // by id, as mirror()
  std::vector<Samples> samples_;              // by band
  std::vector<Middles> middles_;
};

/// Where a mirror is seen: those samples of a layer that show it, and where that layer is itself what a
/// mirror shows, only where that one is seen.
struct Aperture {
  const SceneLayer& layer;
  std::uint8_t mirror;               ///< as SceneLayer::mirror()
  const Aperture* within = nullptr;  ///< null: the layer is the viewport's

  /// Whether any sample of \p part, where the layers' samples are drawn, shows it.
  bool seen_in(const Rectangle& part) const;

  /// Whether sample \p s of pixel (x, y) does.
  bool seen_at(int s, int x, int y) const {
    return *layer.mirror(s, x, y) == mirror && (!within || within->seen_at(s, x, y));
  }

  /// The share of the pixel's samples that do.
  float share(int x, int y) const {
    const int samples = layer.view().samples;
    int seen = 0;
    if (!within)
      seen = layer.samples_of_mirror(mirror, x, y);
    else
      for (int s = 0; s < samples; ++s) seen += seen_at(s, x, y);
    return static_cast<float>(seen) / static_cast<float>(samples);
  }
};

}  // namespace polyhull::processor
