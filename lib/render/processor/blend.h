// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Puts a picture's layers together, band by band, as renderer.h says.
#pragma once

#include <atomic>
#include <climits>
#include <cstdint>
#include <optional>
#include <vector>

#include "render/processor/area_shadow.h"
#include "render/processor/mirror_view.h"
#include "render/processor/scene/albedo_layer.h"
#include "render/processor/scene/scene_layer.h"
#include "render/processor/soft_shadow.h"
#include "render/processor/subject_layer.h"
#include "render/yuv/yuv_picture.h"

namespace polyhull::processor {

/// What subjects take of a light, as the viewport sees it and as the plan's mirrors show it.
struct LightShadow {
  AreaShadow seen;
  std::vector<AreaShadow*> in_mirrors;  // as RenderPlan::mirrors; null: not there
};

/// What one of the plan's mirrors shows.
struct MirrorLayers {
  SoftShadow soft;  ///< on the scene there
  SceneLayer scene;
  AlbedoLayer albedo;
  SubjectLayer image;                ///< the subjects
  std::vector<std::uint8_t> ways;    ///< MirrorView's
  std::optional<Aperture> aperture;  ///< where it is seen
  std::optional<MirrorView> view;
};

/// What a picture is made of: all drawn but the subjects, whose bands are painted on the way.
struct Layers {
  const TracedScene* scene = nullptr;       ///< null: no geometry
  SceneLayer direct;                        ///< the scene as the viewport sees it
  AlbedoLayer albedo;                       ///< of that
  std::vector<MirrorLayers*> mirrors;       ///< as RenderPlan::mirrors
  std::vector<const LightShadow*> shadows;  ///< as RenderPlan::lights
  SoftShadow soft;                          ///< of RenderPlan::soft_lights, on direct
  std::vector<ReadySubject> subjects;
  SubjectLayer front;  ///< the subjects before the viewport
};

/// Where a picture goes: RGBA pixels, or video.
struct PictureTarget {
  std::uint8_t* pixels = nullptr;
  std::ptrdiff_t stride = 0;
  const YuvPicture* video = nullptr;  ///< pixels is null then
};

/// RGBA pixels to draw into, from column left and row top on.
struct PixelRows {
  std::uint8_t* pixels = nullptr;
  std::ptrdiff_t stride = 0;
  int left = 0, top = 0;
  std::uint8_t* at(int x, int y) const { return pixels + (y - top) * stride + 4 * (x - left); }
};

/// The columns left .. right - 1 that drawing has reached.
struct Touched {
  int left = INT_MAX, right = 0;
};

class Blend {
 public:
  /// Blends \p layers over \p background (RGBA rows \p background_stride bytes apart) into \p target;
  /// all must outlive this.
  Blend(Layers& layers, const RenderFrame& frame, const RenderPlan& plan,
        const RenderSettings& settings, const std::uint8_t* background, int background_stride,
        const PictureTarget& target);

  /// The bands that the plan changes.
  int first_band() const { return changed_.y / band_rows; }
  int last_band() const { return (changed_.y + changed_.height - 1) / band_rows; }

  /// Draws band \p band into the target. Several threads may, each another.
  void draw(int band);

  std::atomic<double> seconds_subject = 0.0, seconds_mirror = 0.0, seconds_blend = 0.0;
  /// As RenderStatistics.
  std::atomic<std::uint64_t> pixels_shaded = 0, pixels_changed = 0;

 private:
  /// What a band of a subject layer shows.
  struct Painted {
    Rectangle part;                  // beside it, nothing
    std::vector<glm::vec4> colours;  // of its rows
  };

  /// A thread's working memory.
  struct Workspace {
    SubjectLayer::Scratch scratch;
    Painted front, images[most_mirrors];  // as RenderPlan::mirrors
  };
  static Workspace& workspace();

  /// A row of it.
  struct Span {
    int left = 0, right = 0;
    const glm::vec4* colours = nullptr;  // of column left and on
    glm::vec4 at(int x) const {
      return x >= left && x < right ? colours[x - left] : glm::vec4(0.0f);
    }
    bool reaches(int begin, int end) const { return begin < right && end > left; }
    /// Whether any of columns \p begin to \p end - 1 shows a subject.
    bool any(int begin, int end) const;
  };
  static Span row_of(const Painted& painted, int y);

  /// The layers of a row.
  struct Spans {
    Span front, images[most_mirrors];
  };

  /// What of a row's light is missing, of sixteen pixels that begin at a multiple of 16: E by channel, per
  /// power_.
  struct Missing {
    bool any = false;
    float taken[3][16];  // written where any is
    Vec3f most(int x, int end) const;
  };
  struct AllMissing {
    Missing seen, in_mirrors[most_mirrors];
  };

  /// A light's shadow that a row may have, or all soft lights'.
  struct Shadow {
    const AreaShadow* shadow;  // null: soft
    const SoftShadow* soft;
    const SceneLayer* layer;
    Vec3f power;
    Missing* into;
  };

  /// Up to eight pixels of a row on their way into the picture. What has no part in them stays as
  /// the piece before left it: nothing.
  struct Piece {
    BlendPixels pixels{};
    bool has_subject = true, has_mirror = true;  ///< else all of theirs is nothing
  };

  /// A band's counts, and what of two rows that share their chroma is drawn.
  struct Progress {
    Touched touched;
    std::uint64_t shaded = 0, changed = 0;
  };

  void find_least_taken();
  std::uint32_t darkest_of(int x, int end, int y) const;
  bool is_seen(const Vec3f& taken, std::uint32_t darkest, bool opaque) const;
  std::vector<Shadow> shadows_of(int y, AllMissing& missing) const;
  bool is_lost_unseen(int x, int y, const std::vector<Shadow>& shadows) const;
  static bool find_missing(int x, int y, const std::vector<Shadow>& shadows);
  bool any_reaches(const Spans& layers, int begin, int end) const;
  void blend_row(int y, const Spans& layers, const PixelRows& out, Piece& piece,
                 Progress& progress);
  void blend_piece(int x, int end, int y, const Spans& layers, const AllMissing& missing,
                   const PixelRows& out, Piece& piece, Progress& progress);
  int blend_translucent(int x, int end, int y, const Piece& piece, std::uint32_t* made) const;
  float share_taken(int x, int y, const Vec3f& taken) const;
  void fill_ground(int x, int end, int y, const float (*taken)[16], BlendPixels& pixels);
  static void fill_subject(int x, int end, const Span& over, BlendPixels& pixels);
  void add_mirror(std::size_t mirror, int x, int end, int y, const Spans& layers,
                  const float (*taken)[16], BlendPixels& pixels);
  Vec3f mirror_dimming(MirrorLayers& mirror, int x, int y, float covered);

  Layers& layers_;
  const RenderFrame& frame_;
  const RenderPlan& plan_;
  const RenderSettings& settings_;
  Rectangle changed_;
  const std::uint8_t* background_;
  int background_stride_;
  PictureTarget target_;
  float power_[3] = {};        // of all lights together, as a picture value per albedo and E
  std::vector<Vec3f> powers_;  // of each, as a share of that
  Vec3f soft_power_{0.0f};     // the same of SoftShadow's E
  float no_change_ = 0.0f;     // E that is no change to any pixel
  float least_taken_[3][256];  // by code of the background: E that is none to one as dark
};

}  // namespace polyhull::processor
